#include "ros/input/pose_checks.h"

#include <algorithm>
#include <cmath>

#include "level/frame_points.h"
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

namespace {

/// Points along each edge of the thinned image.
constexpr int kSamples = 24;
/// The camera has to move so far between two images that are compared, or turn.
constexpr double kMinMotion_m = 0.05, kMinTurn_rad = 0.1;
/// Depths that differ by a smaller share are of one surface.
constexpr double kSameDepth = 0.03;
/// Of the points in view so many have to be found with one frame, and have to be missed with the
/// other, for a pair of images to distinguish them.
constexpr double kFound = 0.7, kMissed = 0.4;
constexpr int kMinInView = 60;
/// Pairs that make a verdict, and how many have to agree.
constexpr int kPairs = 8, kMajority = 7;

/// From optical axes to those of the body: z forward is x, x right is -y, y down is -z.
Eigen::Isometry3d bodyFromOptical() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return T;
}

struct Agreement {
  int in_view = 0, found = 0;
  double share() const { return static_cast<double>(found) / in_view; }
};

/// How many points are where the image sees a surface, moved into its optical frame.
Agreement compare(const std::vector<Eigen::Vector3d>& points, const Eigen::Isometry3d& motion,
                  const DepthFrame& frame) {
  const Intrinsics& K = frame.intrinsics;
  Agreement agreement;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = motion * point;
    if (p.z() <= 0.0) continue;
    const double u = K.fx * p.x() / p.z() + K.cx, v = K.fy * p.y() / p.z() + K.cy;
    if (!(u >= 0.0 && v >= 0.0 && u <= frame.width - 1 && v <= frame.height - 1)) continue;
    const double z =
        depthAt(frame, static_cast<int>(std::lround(u)), static_cast<int>(std::lround(v)));
    if (z <= 0.0) continue;
    ++agreement.in_view;
    if (std::abs(z - p.z()) < kSameDepth * z) ++agreement.found;
  }
  return agreement;
}

}  // namespace

void OpticalFrameCheck::add(const DepthFrame& frame) {
  if (state_ != State::kUndecided) return;
  if (has_view_) {
    const Eigen::Isometry3d motion = view_.T_W_C.inverse() * frame.T_W_C;
    if (motion.translation().norm() < kMinMotion_m &&
        Eigen::AngleAxisd(motion.linear()).angle() < kMinTurn_rad) {
      return;
    }
    judge(frame);
  }
  view_ = {thinnedPoints(frame, kSamples, kSamples), frame.T_W_C};
  has_view_ = true;
}

void OpticalFrameCheck::judge(const DepthFrame& frame) {
  const Eigen::Isometry3d motion = frame.T_W_C.inverse() * view_.T_W_C;
  const Eigen::Isometry3d T_B_O = bodyFromOptical();
  const Agreement optical = compare(view_.points_O, motion, frame);
  const Agreement body = compare(view_.points_O, T_B_O.inverse() * motion * T_B_O, frame);
  const bool for_optical = optical.in_view >= kMinInView && optical.share() > kFound;
  const bool for_body = body.in_view >= kMinInView && body.share() > kFound &&
                        (optical.in_view < kMinInView || optical.share() < kMissed);
  if (!for_optical && !for_body) return;
  if (for_body) ++for_body_;
  if (++pairs_ == kPairs) state_ = for_body_ >= kMajority ? State::kBody : State::kDone;
}

}  // namespace dtsdf
