/// The frame W that is level, from what is known of up and of the floor in another frame M; and
/// whether a map frame that is taken as it is can be level.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "dtsdf_mapping/depth_frame.h"
#include "level/floor.h"

namespace dtsdf {

/// T_W_M: z of W is up, and z = 0 are the points p with up . p = `floor_offset_m`. The turn is the
/// smallest that does so, so that a frame that is almost level keeps its x and y; the origin of W
/// lies above or below that of M.
Eigen::Isometry3d levelPose(const Eigen::Vector3d& up_M, double floor_offset_m = 0.0);

/// T_W_M with up along the normal of a floor, which lies at z = 0.
inline Eigen::Isometry3d levelPose(const FloorPlane& floor) {
  return levelPose(floor.normal(), -floor.offset());
}

/// How far z of M is from up, in degrees.
double tiltOf(const Eigen::Isometry3d& T_W_M);

/// Where M lies in W, in words for who runs a program.
std::string describeLevel(const Eigen::Isometry3d& T_W_M);

/// Whether z of a map frame that is taken as it is can be up. Looks at the first images, whose
/// poses are in the map frame. By their floor, or where there is none, by how the first camera
/// stands: in a frame that is the first camera's own, z is where it looks. One thread at a time.
class LevelDoubt {
 public:
  /// True once, when it has made up its mind.
  bool add(const DepthFrame& frame);

  /// Ends the look early, with the images that there were.
  void finish();

  /// What is doubtful, and what to do; empty where nothing is.
  const std::string& text() const { return text_; }

 private:
  FloorSearch search_;
  std::optional<Eigen::Isometry3d> first_T_W_C_;
  bool is_done_ = false;
  std::string text_;
};

}  // namespace dtsdf
