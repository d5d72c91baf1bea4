/// Uses depth images to check that poses map the optical frame to the map frame.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"

namespace dtsdf {

/// Poses often describe the camera's body (x forward, z up) or OpenGL's camera (y up, z backwards),
/// or transform from the map to the camera. Only with the right convention do surfaces stay in
/// place while the camera moves. So points of one image are projected into a later image under each
/// convention. If another convention repeatedly matches far more points than the assumed
/// convention, the poses seem to follow it. Not thread-safe.
class PoseConvention {
 public:
  /// Adds a valid frame. Frames are ignored once there is a verdict, and while the camera hardly
  /// moves.
  void add(const DepthFrame& frame);

  /// Warning about the convention that the poses seem to follow, with advice; empty if the poses
  /// seem right, or if there is no verdict yet.
  const std::string& doubt() const { return doubt_; }

 private:
  static constexpr size_t kConventions = 4;  ///< The first convention leaves poses unchanged.

  void judge(const DepthFrame& frame);

  std::vector<Eigen::Vector3d> points_;  ///< Some points of an earlier image.
  Eigen::Isometry3d T_W_C_ = Eigen::Isometry3d::Identity();
  std::array<int, kConventions> pairs_{};  ///< Image pairs for which each convention is best.
  bool is_done_ = false;
  std::string doubt_;
};

}  // namespace dtsdf
