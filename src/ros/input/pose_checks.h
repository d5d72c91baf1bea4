/// Checks that consecutive poses of a camera are plausible.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "params/text.h"

namespace dtsdf {

/// What is wrong with the motion from the last pose (with its stamp) to this one; nothing if it is
/// within the limits, or if this stamp is earlier than the last. A limit of 0 means no limit.
/// `last` may belong to a dropped frame: if the estimate jumps and stays there, only one frame is
/// dropped.
inline std::optional<std::string> findJump(
    const std::optional<std::pair<double, Eigen::Isometry3d>>& last, double stamp_s,
    const Eigen::Isometry3d& T_W_C, double max_speed_m_s, double max_turn_deg_s) {
  if (!last || stamp_s < last->first) return std::nullopt;
  const double interval_s = stamp_s - last->first;
  const Eigen::Isometry3d& last_T_W_C = last->second;
  constexpr double kMinInterval_s = 1e-3;  // shorter intervals give no usable speed
  const double dt = std::max(interval_s, kMinInterval_s);
  const double distance_m = (T_W_C.translation() - last_T_W_C.translation()).norm();
  const double turn_deg =
      Eigen::AngleAxisd(last_T_W_C.linear().transpose() * T_W_C.linear()).angle() * 180.0 / M_PI;
  const bool too_fast = max_speed_m_s > 0.0 && distance_m > max_speed_m_s * dt;
  const bool turns_too_fast = max_turn_deg_s > 0.0 && turn_deg > max_turn_deg_s * dt;
  if (!too_fast && !turns_too_fast) return std::nullopt;

  return formatted(
      "the pose jumped by %g m and %g degrees in %g s (limits: input/max_speed_m_s = %g, "
      "input/max_turn_deg_s = %g)",
      distance_m, turn_deg, interval_s, max_speed_m_s, max_turn_deg_s);
}

}  // namespace dtsdf
