/// Whether poses are those of the optical frame to the map, as depth and poses show together.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"

namespace dtsdf {

/// Poses are often given as those of the camera's body (x forward, z up), as OpenGL has them (y up,
/// z backwards), or from the map to the camera. While the camera moves, surfaces stay where they
/// are only with the right one of these: points of an earlier image are looked up in a later one
/// each way, and if they are found far more often in one of the other ways, time and again, poses
/// are of that kind. On one thread.
class PoseConvention {
 public:
  /// Looks at a frame that passed its checks, until it has made up its mind.
  void add(const DepthFrame& frame);

  /// What poses seem to be, and what to do; empty while nothing speaks against them.
  const std::string& doubt() const { return doubt_; }

 private:
  static constexpr size_t kWays = 4;  ///< The first one is as given.

  void judge(const DepthFrame& frame);

  std::vector<Eigen::Vector3d> points_;  ///< Points of a thinned earlier image.
  Eigen::Isometry3d T_W_C_ = Eigen::Isometry3d::Identity();
  std::array<int, kWays> pairs_{};  ///< Pairs of images, by the way that fits them best.
  bool is_done_ = false;
  std::string doubt_;
};

}  // namespace dtsdf
