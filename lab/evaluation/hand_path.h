/// The path of a hand-held camera.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace dtsdf {

/// Number and rate of images, and the seed of the path.
struct HandPath {
  size_t count = 600;
  double rate_hz = 30.0;
  uint64_t seed = 1;
};

/// Poses of a camera that is carried along a closed loop through the given poses at 0.5 m/s, with
/// steps, tremor, roll and circular hand motion, while it looks around.
/// @throws std::invalid_argument for fewer than two poses, or if all poses have the same position.
std::vector<Eigen::Isometry3d> handPoses(const std::vector<Eigen::Isometry3d>& through_T_W_C,
                                         const HandPath& path);

}  // namespace dtsdf
