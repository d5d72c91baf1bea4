#include "log/given_motion.h"

#include <algorithm>

namespace dtsdf {
namespace {

/// A motion is continued for so many times as long as it was seen, at most.
constexpr double kFarthestAhead = 3.0;

/// In metres, and of a metre's lever.
double distance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm() + (a.linear() - b.linear()).norm();
}

}  // namespace

void GivenMotion::add(const StampedPose& given) {
  before_ = beginsAnew(given) ? std::nullopt : newest_;
  newest_ = given;
}

bool GivenMotion::takesOver(const Eigen::Isometry3d& T_W_S, const StampedPose& given) {
  const bool takes_over = beginsAnew(given) || isMovedBy(T_W_S, given);
  add(given);
  return takes_over;
}

/// What is expected, in the frame of the newest pose: the motion of before, for as long.
Eigen::Isometry3d GivenMotion::motionTo(double stamp_s) const {
  if (!before_ || newest_->stamp_s <= before_->stamp_s) return Eigen::Isometry3d::Identity();
  const double times = std::clamp(
      (stamp_s - newest_->stamp_s) / (newest_->stamp_s - before_->stamp_s), 0.0, kFarthestAhead);
  const Eigen::Isometry3d seen = before_->T_W_C.inverse() * newest_->T_W_C;
  Eigen::AngleAxisd turn(seen.linear());
  turn.angle() *= times;
  Eigen::Isometry3d motion(turn);
  motion.translation() = times * seen.translation();
  return motion;
}

bool GivenMotion::isMovedBy(const Eigen::Isometry3d& T_W_S, const StampedPose& next) const {
  if (!newest_) return false;
  const Eigen::Isometry3d expected = newest_->T_W_C * motionTo(next.stamp_s);
  return distance(next.T_W_C, T_W_S * expected) < distance(next.T_W_C, expected);
}

}  // namespace dtsdf
