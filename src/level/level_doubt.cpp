#include "level/level_doubt.h"

#include <cmath>
#include <cstdio>

#include "level/level_pose.h"

namespace dtsdf {
namespace {

/// Ramps are less steep, and a floor is found better.
constexpr double kMaxTilt_deg = 5.0;
/// Cosine of 60 degrees.
constexpr double kHalf = 0.5;

std::string adviceOn(const std::string& finding) {
  return finding +
         ", so z of the map frame does not point up, as heights in grids and slices need; "
         "set map/level to floor or imu, or map_frame to a level frame";
}

std::string doubtAboutFloor(const FloorPlane& floor) {
  const double tilt_deg = tiltOf(levelPose(floor.normal));
  if (tilt_deg <= kMaxTilt_deg) return "";
  char finding[96];
  std::snprintf(finding, sizeof(finding),
                "the floor of the first images is %.0f degrees from level", tilt_deg);
  return adviceOn(finding);
}

/// A camera that looks down has its y axis level, too, and is common; one that looks up is not.
std::string doubtAboutCamera(const Eigen::Isometry3d& T_W_C) {
  const double up = -T_W_C.linear()(2, 1), forward = T_W_C.linear()(2, 2);
  if (up < kHalf && forward > kHalf) return adviceOn("the first camera looks along z");
  if (up < -kHalf) return adviceOn("the first camera's image is upside down");
  return "";
}

}  // namespace

bool LevelDoubt::add(const DepthFrame& frame) {
  if (is_done_) return false;
  if (!first_T_W_C_ && frame.T_W_C.matrix().allFinite()) first_T_W_C_ = frame.T_W_C;
  if (!search_.add(frame)) return false;
  finish();
  return true;
}

void LevelDoubt::finish() {
  if (is_done_) return;
  is_done_ = true;
  search_.finish();
  if (search_.floor()) {
    text_ = doubtAboutFloor(*search_.floor());
  } else if (first_T_W_C_) {
    text_ = doubtAboutCamera(*first_T_W_C_);
  }
}

}  // namespace dtsdf
