#include "level/level_pose.h"

#include <cmath>

#include "params/text.h"

namespace dtsdf {
namespace {

/// Smallest rotation that turns `up` to z.
Eigen::Quaterniond smallestTurnToZ(const Eigen::Vector3d& up) {
  constexpr double kOpposite = 1e-9;  // opposite to z, any half turn will do
  if (1.0 + up.z() < kOpposite) return {0.0, 1.0, 0.0, 0.0};
  const Eigen::Vector3d axis = up.cross(Eigen::Vector3d::UnitZ());
  return Eigen::Quaterniond(1.0 + up.z(), axis.x(), axis.y(), axis.z()).normalized();
}

}  // namespace

Eigen::Isometry3d levelPose(const Eigen::Vector3d& up_M, double floor_offset_m) {
  Eigen::Isometry3d T_W_M = Eigen::Isometry3d::Identity();
  T_W_M.linear() = smallestTurnToZ(up_M.normalized()).toRotationMatrix();
  T_W_M.translation().z() = 0.0 - floor_offset_m;  // avoids -0
  return T_W_M;
}

double tiltOf(const Eigen::Isometry3d& T_W_M) {
  constexpr double kDegrees = 57.29577951308232;
  const auto z_row = T_W_M.linear().row(2);
  return kDegrees * std::atan2(std::hypot(z_row.x(), z_row.y()), z_row.z());
}

std::string describeLevel(const Eigen::Isometry3d& T_W_M) {
  return formatted(
      "z of the map frame was %.2f degrees off, and its origin is at a height of %.3f m",
      tiltOf(T_W_M), T_W_M.translation().z());
}

namespace {

/// More than the slope of a ramp plus the error of finding a floor.
constexpr double kMaxTilt_deg = 5.0;
/// Cosine of 60 degrees.
constexpr double kHalf = 0.5;

std::string adviceOn(const std::string& finding) {
  return finding +
         ", so z of the map frame does not point up, but heights of grids and slices need that; "
         "set map/level to floor or imu, or map_frame to a level frame";
}

std::string doubtAboutFloor(const FloorPlane& floor) {
  const double tilt_deg = tiltOf(levelPose(floor.normal()));
  if (tilt_deg <= kMaxTilt_deg) return "";
  return adviceOn(formatted("the floor of the first images is %.0f degrees from level", tilt_deg));
}

/// Cameras that look down are common and also have a level y axis; those that look up are rare.
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
