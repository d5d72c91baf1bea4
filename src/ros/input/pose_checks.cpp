#include "ros/input/pose_checks.h"

#include <algorithm>
#include <cmath>

#include "params/text.h"

namespace dtsdf {
namespace {

/// Stamps nearer than this show no speed.
constexpr double kMinInterval_s = 1e-3;

}  // namespace

std::optional<std::string> MotionGate::check(double stamp_s, const Eigen::Isometry3d& T_W_C) {
  const double interval_s = stamp_s - last_stamp_s_;
  const Eigen::Isometry3d last_T_W_C = last_T_W_C_;
  const bool comparable = has_last_ && interval_s >= 0.0;  // stamps going back start anew
  has_last_ = true;
  last_stamp_s_ = stamp_s;
  last_T_W_C_ = T_W_C;
  if (!comparable) return std::nullopt;

  const double dt = std::max(interval_s, kMinInterval_s);
  const double distance_m = (T_W_C.translation() - last_T_W_C.translation()).norm();
  const double turn_deg =
      Eigen::AngleAxisd(last_T_W_C.linear().transpose() * T_W_C.linear()).angle() * 180.0 / M_PI;
  const bool too_fast = max_speed_m_s_ > 0.0 && distance_m > max_speed_m_s_ * dt;
  const bool turns_too_fast = max_turn_deg_s_ > 0.0 && turn_deg > max_turn_deg_s_ * dt;
  if (!too_fast && !turns_too_fast) return std::nullopt;

  return formatted(
      "the pose jumped by %g m and %g degrees in %g s (limits: input/max_speed_m_s = %g, "
      "input/max_turn_deg_s = %g)",
      distance_m, turn_deg, interval_s, max_speed_m_s_, max_turn_deg_s_);
}

}  // namespace dtsdf
