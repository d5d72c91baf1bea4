#include "io/trajectory.h"

#include <algorithm>
#include <cmath>

namespace dtsdf {
namespace {

/// Today's stamps in seconds are good to a quarter of a microsecond as doubles.
constexpr double kStampResolution_s = 1e-6;

Eigen::Isometry3d interpolate(const StampedPose& before, const StampedPose& after, double stamp_s) {
  const double share = (stamp_s - before.stamp_s) / (after.stamp_s - before.stamp_s);
  const Eigen::Quaterniond from(before.T_W_C.linear()), to(after.T_W_C.linear());
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  T_W_C.linear() = from.slerp(share, to).normalized().toRotationMatrix();
  T_W_C.translation() =
      (1.0 - share) * before.T_W_C.translation() + share * after.T_W_C.translation();
  return T_W_C;
}

}  // namespace

Trajectory::Trajectory(std::vector<StampedPose> poses) : poses_(std::move(poses)) {
  std::stable_sort(poses_.begin(), poses_.end(),
                   [](const auto& a, const auto& b) { return a.stamp_s < b.stamp_s; });
  poses_.erase(std::unique(poses_.begin(), poses_.end(),
                           [](const auto& a, const auto& b) { return a.stamp_s == b.stamp_s; }),
               poses_.end());
}

std::optional<Eigen::Isometry3d> Trajectory::poseAt(double stamp_s, double tolerance_s) const {
  const double reach_s = tolerance_s + kStampResolution_s;
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), stamp_s,
                       [](const StampedPose& pose, double stamp) { return pose.stamp_s < stamp; });
  const bool has_after = after != poses_.end(), has_before = after != poses_.begin();
  const bool after_is_near = has_after && after->stamp_s - stamp_s <= reach_s;
  const bool before_is_near = has_before && stamp_s - std::prev(after)->stamp_s <= reach_s;
  if (!after_is_near && !before_is_near) return std::nullopt;
  if (!has_before || (has_after && after->stamp_s == stamp_s)) return after->T_W_C;
  if (!has_after) return std::prev(after)->T_W_C;
  return interpolate(*std::prev(after), *after, stamp_s);
}

std::string noPoseWithin(double tolerance_s) {
  return "no pose within " + std::to_string(std::lround(1000.0 * tolerance_s)) + " ms";
}

}  // namespace dtsdf
