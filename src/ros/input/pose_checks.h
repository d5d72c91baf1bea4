/// Whether a camera can be where its poses say that it is.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"

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

/// Whether the images' frame is an optical one, as depth and poses show together. Drivers and
/// simulators often give images the frame of the camera's body (x forward, z up) in place of its
/// optical frame (z forward, y down). While the camera moves, surfaces stay where they are only
/// with the right one of the two: points of an earlier image are looked up in a later one either
/// way, and if they are found with x forward alone, time and again, the frame is a body's. On one
/// thread.
class OpticalFrameCheck {
 public:
  /// Looks at a frame that passed its checks, until it has made up its mind.
  void add(const DepthFrame& frame);

  /// True once the frame is known to be that of a body.
  bool isBodyFrame() const { return state_ == State::kBody; }

 private:
  enum class State { kUndecided, kDone, kBody };

  /// A thinned image: points in the optical frame.
  struct View {
    std::vector<Eigen::Vector3d> points_O;
    Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  };

  void judge(const DepthFrame& frame);

  State state_ = State::kUndecided;
  bool has_view_ = false;
  View view_;
  int pairs_ = 0, for_body_ = 0;
};

}  // namespace dtsdf
