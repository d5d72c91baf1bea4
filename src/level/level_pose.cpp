#include "level/level_pose.h"

#include <cmath>

#include "params/text.h"

namespace dtsdf {
namespace {

/// Smallest rotation that turns `up` into z.
Eigen::Quaterniond smallestTurnToZ(const Eigen::Vector3d& up) {
  constexpr double kOpposite = 1e-9;  // `up` then points along -z; any horizontal axis will do
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
      "z of the map frame was %.2f degrees off vertical, and its origin is at a height of %.3f m",
      tiltOf(T_W_M), T_W_M.translation().z());
}

}  // namespace dtsdf
