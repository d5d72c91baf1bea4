/// Whether a camera can be where its poses say that it is.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

namespace dtsdf {

/// Distinguishes a camera that moves from one whose pose jumps. Compares each pose with the one
/// before, dropped or not: when an estimate jumps to another place and stays there, only the first
/// frame after the jump is lost.
class MotionGate {
 public:
  /// 0 switches a limit off.
  MotionGate(double max_speed_m_s, double max_turn_deg_s)
      : max_speed_m_s_(max_speed_m_s), max_turn_deg_s_(max_turn_deg_s) {}

  /// What is wrong with the way from the last pose to this one, or nothing.
  std::optional<std::string> check(double stamp_s, const Eigen::Isometry3d& T_W_C);

 private:
  double max_speed_m_s_;
  double max_turn_deg_s_;
  bool has_last_ = false;
  double last_stamp_s_ = 0.0;
  Eigen::Isometry3d last_T_W_C_ = Eigen::Isometry3d::Identity();
};

}  // namespace dtsdf
