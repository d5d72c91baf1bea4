#include "journal/pose_correction.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "params/text.h"
#include "poses/between.h"

namespace dtsdf {
namespace {

bool isBefore(const StampedPose& pose, double stamp_s) { return pose.stamp_s < stamp_s; }

std::string inSeconds(double stamp_s) { return formatted("%.3f s", stamp_s); }

/// @throws std::runtime_error
void checkRigid(const StampedPose& pose) {
  const Eigen::Matrix3d R = pose.T_W_C.linear();
  constexpr double kTolerance = 1e-3;
  const bool is_rigid = std::isfinite(pose.stamp_s) && pose.T_W_C.matrix().allFinite() &&
                        (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < kTolerance &&
                        R.determinant() > 0.0;
  if (is_rigid) return;
  throw std::runtime_error("the corrected pose at " + inSeconds(pose.stamp_s) +
                           " is not a rigid transform");
}

bool isSame(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm() <= PoseCorrection::kMin &&
         (a.linear() - b.linear()).norm() <= PoseCorrection::kMin;
}

/// Sorts poses by stamp. @throws std::runtime_error if different poses have the same stamp, as in a
/// nav_msgs/Path whose poses are all stamped with the time of publication.
Trajectory sortedByStamp(std::vector<StampedPose> poses) {
  std::stable_sort(poses.begin(), poses.end(),
                   [](const auto& a, const auto& b) { return a.stamp_s < b.stamp_s; });
  for (size_t i = 1; i < poses.size(); ++i) {
    if (poses[i].stamp_s != poses[i - 1].stamp_s) continue;
    if (isSame(poses[i].T_W_C, poses[i - 1].T_W_C)) continue;
    throw std::runtime_error("different corrected poses have the same stamp, " +
                             inSeconds(poses[i].stamp_s) +
                             "; give each pose the stamp of its image");
  }
  return Trajectory(std::move(poses));
}

bool hasPoseOf(const StampedPose& image, const std::vector<StampedPose>& corrected) {
  const auto next = std::lower_bound(corrected.begin(), corrected.end(),
                                     image.stamp_s - PoseCorrection::kSameStamp_s, isBefore);
  return next != corrected.end() && next->stamp_s <= image.stamp_s + PoseCorrection::kSameStamp_s;
}

/// The pose at which the camera's image with this stamp was fused. If there is no such image, the
/// pose is interpolated between the images before and after the stamp; std::nullopt if one of these
/// images is missing or has a corrected pose itself, or if they are too far apart in time.
std::optional<Eigen::Isometry3d> poseAt(double stamp_s, const std::vector<StampedPose>& fused,
                                        const std::vector<StampedPose>& corrected) {
  const auto after = std::lower_bound(fused.begin(), fused.end(), stamp_s, isBefore);
  const auto isAt = [&](auto pose) {
    return std::abs(pose->stamp_s - stamp_s) <= PoseCorrection::kSameStamp_s;
  };
  const bool has_after = after != fused.end(), has_before = after != fused.begin();
  if (has_before && isAt(after - 1) &&
      !(has_after && after->stamp_s - stamp_s < stamp_s - (after - 1)->stamp_s)) {
    return (after - 1)->T_W_C;
  }
  if (has_after && isAt(after)) return after->T_W_C;
  if (!has_after || !has_before) return std::nullopt;
  const double gap_s = after->stamp_s - (after - 1)->stamp_s;
  if (gap_s > PoseCorrection::kMaxGap_s) return std::nullopt;
  if (hasPoseOf(*(after - 1), corrected) || hasPoseOf(*after, corrected)) return std::nullopt;
  return between((after - 1)->T_W_C, after->T_W_C, (stamp_s - (after - 1)->stamp_s) / gap_s);
}

std::string describe(const std::vector<StampedPose>& poses) {
  if (poses.empty()) return "none";
  return inSeconds(poses.front().stamp_s) + " to " + inSeconds(poses.back().stamp_s);
}

}  // namespace

PoseCorrection::PoseCorrection(std::vector<StampedPose> corrected,
                               const std::vector<StampedPose>& fused) {
  for (const StampedPose& pose : corrected) checkRigid(pose);
  const Trajectory sorted = sortedByStamp(std::move(corrected));
  for (const StampedPose& pose : sorted.poses()) {
    const std::optional<Eigen::Isometry3d> from = poseAt(pose.stamp_s, fused, sorted.poses());
    if (!from) continue;
    anchors_.push_back({pose.stamp_s, *from, pose.T_W_C});
    const double distance_m = anchors_.back().distance_m();
    if (distance_m > kFarthest_m) {
      throw std::runtime_error(
          "the corrected pose at " + inSeconds(pose.stamp_s) + " is " +
          formatted("%.6g", distance_m) +
          " m from where its image was fused, too far for a correction; check its frame");
    }
  }
  if (anchors_.empty()) {
    throw std::runtime_error("no corrected pose matches the stamp of an image: pose stamps are " +
                             describe(sorted.poses()) + ", the images' stamps " + describe(fused));
  }
  checkFrame();
}

double PoseCorrection::Anchor::angle_rad() const {
  return Eigen::AngleAxisd(from.linear().transpose() * to.linear()).angle();
}

/// @throws std::runtime_error
void PoseCorrection::checkFrame() const {
  const auto byAngle = [](const Anchor& a, const Anchor& b) {
    return a.angle_rad() < b.angle_rad();
  };
  const auto [least, most] = std::minmax_element(anchors_.begin(), anchors_.end(), byAngle);
  if (least->angle_rad() <= kMaxCommonTurn_rad) return;
  throw std::runtime_error(
      formatted("from %.3f s to %.3f s, all %zu corrected poses would turn their images by more "
                "than 1 radian (the one at %.3f s by %.3g): they are not in the map's frame",
                anchors_.front().stamp_s, anchors_.back().stamp_s, anchors_.size(), most->stamp_s,
                most->angle_rad()));
}

std::vector<StampedPose> PoseCorrection::used() const {
  std::vector<StampedPose> poses;
  for (const Anchor& anchor : anchors_) poses.push_back({anchor.stamp_s, anchor.to});
  return poses;
}

double PoseCorrection::farthest() const {
  double farthest = 0.0;
  for (const Anchor& anchor : anchors_) {
    farthest = std::max({farthest, anchor.distance_m(), anchor.angle_rad()});
  }
  return farthest;
}

Eigen::Isometry3d PoseCorrection::moved(const Anchor& anchor,
                                        const Eigen::Isometry3d& T_W_C) const {
  if (T_W_C.matrix() == anchor.from.matrix()) return anchor.to;
  return anchor.to * (anchor.from.inverse() * T_W_C);
}

Eigen::Isometry3d PoseCorrection::correct(double stamp_s, const Eigen::Isometry3d& T_W_C) const {
  const auto after =
      std::lower_bound(anchors_.begin(), anchors_.end(), stamp_s,
                       [](const Anchor& anchor, double stamp) { return anchor.stamp_s < stamp; });
  Eigen::Isometry3d pose;
  if (after == anchors_.begin()) {
    pose = moved(*after, T_W_C);
  } else if (after == anchors_.end()) {
    pose = moved(anchors_.back(), T_W_C);
  } else {
    const Anchor& before = *(after - 1);
    const double share = (stamp_s - before.stamp_s) / (after->stamp_s - before.stamp_s);
    const Eigen::Isometry3d by_before = moved(before, T_W_C), by_after = moved(*after, T_W_C);
    const bool is_of_one = std::abs(stamp_s - before.stamp_s) <= kSameStamp_s ||
                           std::abs(after->stamp_s - stamp_s) <= kSameStamp_s;
    pose = !is_of_one ? between(by_before, by_after, share) : share < 0.5 ? by_before : by_after;
  }
  return isSame(pose, T_W_C) ? T_W_C : pose;
}

namespace {

/// A motion is extrapolated for at most this multiple of its observed duration.
constexpr double kMaxExtrapolation = 3.0;
/// A jump counts as the correction if the two differ by less than this fraction of the correction.
constexpr double kSameJump = 1.0 / 3.0;
/// The correction must exceed the uncertainty in the expected pose by this factor.
constexpr double kMinJumpRatio = 2.0;
/// Factor by which `unevenness_` decays with each image.
constexpr double kDecay = 0.8;

/// Distance between the positions in metres, plus about 1.4 times the angle between the
/// orientations in radians.
double distance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm() + (a.linear() - b.linear()).norm();
}

}  // namespace

void GivenMotion::add(const StampedPose& given) {
  if (isNewRecording(given)) {
    *this = GivenMotion();
  } else if (before_) {
    unevenness_ = std::max(kDecay * unevenness_, distance(given.T_W_C, expectedAt(given.stamp_s)));
  }
  before_ = newest_;
  newest_ = given;
}

bool GivenMotion::adoptsCorrection(const Eigen::Isometry3d& T_W_S, const StampedPose& given) {
  const bool has_adopted = isNewRecording(given) || isMovedBy(T_W_S, given);
  if (has_adopted) {  // so that the jump is not mistaken for motion
    if (before_) before_->T_W_C = T_W_S * before_->T_W_C;
    if (newest_) newest_->T_W_C = T_W_S * newest_->T_W_C;
  }
  add(given);
  return has_adopted;
}

/// Time until this stamp, as a multiple of the last interval between poses.
double GivenMotion::stepsTo(double stamp_s) const {
  if (!before_ || newest_->stamp_s <= before_->stamp_s) return 0.0;
  return std::max(0.0, (stamp_s - newest_->stamp_s) / (newest_->stamp_s - before_->stamp_s));
}

/// Extrapolates the last motion to this stamp, by at most kMaxExtrapolation intervals.
Eigen::Isometry3d GivenMotion::expectedAt(double stamp_s) const {
  const double steps = std::min(stepsTo(stamp_s), kMaxExtrapolation);
  if (steps == 0.0) return newest_->T_W_C;
  const Eigen::Isometry3d seen = before_->T_W_C.inverse() * newest_->T_W_C;
  Eigen::AngleAxisd turn(seen.linear());
  turn.angle() *= steps;
  Eigen::Isometry3d motion(turn);
  motion.translation() = steps * seen.translation();
  return newest_->T_W_C * motion;
}

/// Uncertainty of the expected pose: unevenness_, or more after a gap in the poses.
double GivenMotion::uncertaintyAt(double stamp_s) const {
  const double unseen = stepsTo(stamp_s) - kMaxExtrapolation;
  if (unseen <= 0.0) return unevenness_;
  return std::max(unevenness_, unseen * distance(before_->T_W_C, newest_->T_W_C));
}

bool GivenMotion::isMovedBy(const Eigen::Isometry3d& T_W_S, const StampedPose& next) const {
  if (!newest_) return false;
  const Eigen::Isometry3d expected = expectedAt(next.stamp_s), moved = T_W_S * expected;
  const double jump = distance(moved, expected);
  return jump > kMinJumpRatio * uncertaintyAt(next.stamp_s) &&
         distance(next.T_W_C, moved) < kSameJump * jump;
}

}  // namespace dtsdf
