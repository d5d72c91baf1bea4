#include "log/given_motion.h"

#include <algorithm>

namespace dtsdf {
namespace {

/// A motion is continued for so many times as long as it was seen, at most.
constexpr double kFarthestAhead = 3.0;
/// A jump is that of a correction if it differs from it by less than this share of it.
constexpr double kSameJump = 1.0 / 3.0;
/// And if it is so many times as large as what else may be.
constexpr double kStandsOut = 2.0;
/// By this the unevenness of a motion fades with each image.
constexpr double kFades = 0.8;

/// In metres, and of a metre's lever.
double distance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm() + (a.linear() - b.linear()).norm();
}

}  // namespace

void GivenMotion::add(const StampedPose& given) {
  if (beginsAnew(given)) {
    *this = GivenMotion();
  } else if (before_) {
    unevenness_ = std::max(kFades * unevenness_, distance(given.T_W_C, expectedAt(given.stamp_s)));
  }
  before_ = newest_;
  newest_ = given;
}

bool GivenMotion::takesOver(const Eigen::Isometry3d& T_W_S, const StampedPose& given) {
  const bool takes_over = beginsAnew(given) || isMovedBy(T_W_S, given);
  if (takes_over) {  // so that the jump is no part of the motion
    if (before_) before_->T_W_C = T_W_S * before_->T_W_C;
    if (newest_) newest_->T_W_C = T_W_S * newest_->T_W_C;
  }
  add(given);
  return takes_over;
}

/// Of the length of the last one.
double GivenMotion::stepsTo(double stamp_s) const {
  if (!before_ || newest_->stamp_s <= before_->stamp_s) return 0.0;
  return std::max(0.0, (stamp_s - newest_->stamp_s) / (newest_->stamp_s - before_->stamp_s));
}

/// By the motion of before, for as long.
Eigen::Isometry3d GivenMotion::expectedAt(double stamp_s) const {
  const double steps = std::min(stepsTo(stamp_s), kFarthestAhead);
  if (steps == 0.0) return newest_->T_W_C;
  const Eigen::Isometry3d seen = before_->T_W_C.inverse() * newest_->T_W_C;
  Eigen::AngleAxisd turn(seen.linear());
  turn.angle() *= steps;
  Eigen::Isometry3d motion(turn);
  motion.translation() = steps * seen.translation();
  return newest_->T_W_C * motion;
}

/// How far from there it may be, as uneven as the motion is, and as it may go on while nothing is
/// seen of it.
double GivenMotion::doubtAt(double stamp_s) const {
  const double unseen = stepsTo(stamp_s) - kFarthestAhead;
  if (unseen <= 0.0) return unevenness_;
  return std::max(unevenness_, unseen * distance(before_->T_W_C, newest_->T_W_C));
}

bool GivenMotion::isMovedBy(const Eigen::Isometry3d& T_W_S, const StampedPose& next) const {
  if (!newest_) return false;
  const Eigen::Isometry3d expected = expectedAt(next.stamp_s), moved = T_W_S * expected;
  const double jump = distance(moved, expected);
  return jump > kStandsOut * doubtAt(next.stamp_s) &&
         distance(next.T_W_C, moved) < kSameJump * jump;
}

}  // namespace dtsdf
