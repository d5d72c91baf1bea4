/// Simulates the path of a hand-held camera.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace dtsdf {

/// Number of images, their rate, and the random seed.
struct HandPath {
  size_t count = 600;
  double rate_hz = 30.0;
  uint64_t seed = 1;
};

/// Poses of a camera that is carried at 0.5 m/s along a closed loop through the given poses, with
/// steps, tremor, roll, circular hand motion and changes of viewing direction.
/// @throws std::invalid_argument for fewer than two poses, or if all poses have the same position.
std::vector<Eigen::Isometry3d> handPoses(const std::vector<Eigen::Isometry3d>& through_T_W_C,
                                         const HandPath& path);

}  // namespace dtsdf
