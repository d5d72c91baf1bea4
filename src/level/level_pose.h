/// Computes a level frame W from the vertical and the floor in another frame M, and judges whether
/// a given map frame is level.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "dtsdf_mapping/depth_frame.h"
#include "level/floor.h"

namespace dtsdf {

/// T_W_M, such that z of W is up, and the points p with up . p = `floor_offset_m` have z = 0. The
/// rotation is the smallest possible, so an almost level frame keeps its x and y. The origin of W
/// is straight above or below that of M.
Eigen::Isometry3d levelPose(const Eigen::Vector3d& up_M, double floor_offset_m = 0.0);

/// T_W_M with up along the normal of a floor, and the floor at z = 0.
inline Eigen::Isometry3d levelPose(const FloorPlane& floor) {
  return levelPose(floor.normal(), -floor.offset());
}

/// Angle between z of M and up, in degrees.
double tiltOf(const Eigen::Isometry3d& T_W_M);

/// Describes T_W_M for users.
std::string describeLevel(const Eigen::Isometry3d& T_W_M);

/// Judges from the first images, whose poses are in the map frame, whether z of that frame can be
/// up: by their floor or, if none is found, by the pose of the first camera. If the map frame is
/// the first camera's own frame, that camera looks along z. One thread at a time.
class LevelDoubt {
 public:
  /// Adds an image. @return true once, when the verdict is reached.
  bool add(const DepthFrame& frame);

  /// Reaches the verdict early, with the images added so far.
  void finish();

  /// What is doubtful and what to do; empty if nothing is.
  const std::string& text() const { return text_; }

 private:
  FloorSearch search_;
  std::optional<Eigen::Isometry3d> first_T_W_C_;
  bool is_done_ = false;
  std::string text_;
};

}  // namespace dtsdf
