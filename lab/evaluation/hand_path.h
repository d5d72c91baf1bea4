/// The way of a camera in a hand.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace dtsdf {

/// How fast images follow each other, and which of the many ways is taken.
struct HandPath {
  size_t count = 600;
  double rate_hz = 30.0;
  uint64_t seed = 1;
};

/// Poses of a camera that is carried along a closed loop through the given ones at half a walk's
/// pace, with steps, tremor, roll and circles of the hand, and that looks about.
/// @throws std::invalid_argument for fewer than two poses, or if all lie in one place.
std::vector<Eigen::Isometry3d> handPoses(const std::vector<Eigen::Isometry3d>& through_T_W_C,
                                         const HandPath& path);

}  // namespace dtsdf
