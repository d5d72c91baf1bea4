#include "log/logged_poses.h"

#include <algorithm>
#include <stdexcept>

namespace dtsdf {
namespace {

bool isDepthOfFirst(const LoggedPoses::Item& item) {
  return item.entry.head.kind == LogKind::kDepth && item.image.camera == 0;
}

/// What of them lies before the first image cannot be fused again.
void checkReach(const LogCorrection& correction, double first_s) {
  for (const StampedPose& pose : correction.poses) {
    if (pose.stamp_s >= first_s - PoseCorrection::kSameStamp_s) continue;
    throw std::runtime_error(reachesBack(pose.stamp_s, first_s));
  }
}

void note(const LoggedPoses::Item& item, const Eigen::Isometry3d& T_W_C, CorrectionEffect& effect) {
  effect.first_moved = std::min(effect.first_moved, item.entry.head.number);
  if (item.entry.head.kind != LogKind::kDepth) return;
  ++effect.moved;
  const Eigen::Isometry3d T = item.T_W_C.inverse() * T_W_C;
  effect.farthest_m = std::max(effect.farthest_m, T.translation().norm());
  effect.farthest_rad = std::max(effect.farthest_rad, Eigen::AngleAxisd(T.linear()).angle());
}

}  // namespace

std::string reachesBack(double stamp_s, double first_s) {
  return "the correction reaches back to " + std::to_string(stamp_s) +
         " s, but the log holds images from " + std::to_string(first_s) +
         " s on; raise log/max_gb, or correct what is later";
}

void LoggedPoses::add(LogEntry entry) {
  Item item;
  const LogKind kind = entry.head.kind;
  item.is_image = kind == LogKind::kDepth || kind == LogKind::kColour;
  item.T_W_C = Eigen::Isometry3d::Identity();
  if (item.is_image) {
    item.image = readImage(kind, entry.description);
    item.T_W_C = item.image.T_W_C;
  } else if (kind == LogKind::kCorrection) {
    correct(readCorrection(entry.description), false);
    running_.clear();  // what follows it came when it was known
  }
  item.entry = std::move(entry);
  if (item.is_image) {
    for (Running& running : running_) item.T_W_C = correctNext(running, item);
  }
  items_.push_back(std::move(item));
}

/// By the poses so far and what is known of the images before it, so that an image has the same
/// pose whether it is in the log when the correction comes, or is added later.
Eigen::Isometry3d LoggedPoses::correctNext(Running& running, const Item& item) {
  const StampedPose given{item.image.stamp_s, item.T_W_C};
  const bool is_named = given.stamp_s <= running.poses.last_s();
  if (isDepthOfFirst(item)) {
    const Eigen::Isometry3d motion =
        is_named ? Eigen::Isometry3d::Identity() : running.poses.lastMotion();
    if (running.given.takesOver(motion, given)) running.is_taken_over = true;
  }
  if (running.is_taken_over) return item.T_W_C;
  return running.poses.correct(given.stamp_s, item.T_W_C);
}

/// The first image of the recording that those before a number end with.
size_t LoggedPoses::beginOfPass(uint64_t before) const {
  size_t begin = 0;
  GivenMotion given;
  for (size_t i = 0; i < items_.size() && items_[i].entry.head.number < before; ++i) {
    if (!isDepthOfFirst(items_[i])) continue;
    const StampedPose pose{items_[i].image.stamp_s, items_[i].T_W_C};
    if (given.beginsAnew(pose)) begin = i;
    given.add(pose);
  }
  return begin;
}

std::vector<StampedPose> LoggedPoses::firstCamera(uint64_t before) const {
  std::vector<StampedPose> poses;
  for (size_t i = beginOfPass(before); i < items_.size(); ++i) {
    if (items_[i].entry.head.number >= before) break;
    if (isDepthOfFirst(items_[i])) poses.push_back({items_[i].image.stamp_s, items_[i].T_W_C});
  }
  return Trajectory(std::move(poses)).poses();
}

LoggedPoses::Plan LoggedPoses::plan(const LogCorrection& correction, bool has_lost_images) const {
  const size_t pass = beginOfPass(correction.before);
  const std::vector<StampedPose> fused = firstCamera(correction.before);
  Plan plan{{PoseCorrection(correction.poses, fused)}, {}, {}};
  if (has_lost_images && pass == 0) {
    checkReach(correction, fused.front().stamp_s);
    const StampedPose& first = fused.front();
    if (plan.running.poses.correct(first.stamp_s, first.T_W_C).matrix() != first.T_W_C.matrix()) {
      throw std::runtime_error(
          "the correction moves the first image that the log holds, and with "
          "it those before, which it no longer has; raise log/max_gb");
    }
  }
  plan.effect.first_moved = correction.before;
  for (size_t i = pass; i < items_.size(); ++i) {
    if (!items_[i].is_image) continue;
    const Eigen::Isometry3d T_W_C = correctNext(plan.running, items_[i]);
    if (T_W_C.matrix() == items_[i].T_W_C.matrix()) continue;
    note(items_[i], T_W_C, plan.effect);
    plan.moves.emplace_back(i, T_W_C);
  }
  return plan;
}

CorrectionEffect LoggedPoses::correct(const LogCorrection& correction, bool has_lost_images) {
  Plan made = plan(correction, has_lost_images);
  for (const auto& [i, T_W_C] : made.moves) items_[i].T_W_C = T_W_C;
  running_.push_back(std::move(made.running));
  return made.effect;
}

Eigen::Isometry3d LoggedPoses::motion() const {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (const Running& running : running_) {
    if (!running.is_taken_over) T = running.poses.lastMotion() * T;
  }
  return T;
}

}  // namespace dtsdf
