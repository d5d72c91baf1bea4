#include "log/logged_poses.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace dtsdf {
namespace {

bool isDepthOfFirst(const LoggedPoses::Item& item) {
  return item.entry.head.kind == LogKind::kDepth && item.image.camera == 0;
}

/// What of them lies before the first image cannot be fused again.
void checkReach(const LogCorrection& correction, double first_s) {
  for (const StampedPose& pose : correction.poses) {
    if (pose.stamp_s >= first_s - PoseCorrection::kSameStamp_s) continue;
    throw std::runtime_error("the correction reaches back to " + std::to_string(pose.stamp_s) +
                             " s, but the log holds images from " + std::to_string(first_s) +
                             " s on; raise log/max_gb, or correct what is later");
  }
}

}  // namespace

void LoggedPoses::add(LogEntry entry) {
  Item item;
  const LogKind kind = entry.head.kind;
  item.is_image = kind == LogKind::kDepth || kind == LogKind::kColour;
  item.T_W_C = Eigen::Isometry3d::Identity();
  if (item.is_image) {
    item.image = readImage(kind, entry.description);
    item.T_W_C = item.image.T_W_C;
    if (newest_ && item.image.stamp_s <= until_s_) {
      item.T_W_C = newest_->correct(item.image.stamp_s, item.T_W_C);
    }
  } else if (kind == LogKind::kCorrection) {
    correct(readCorrection(entry.description), false);
    newest_.reset();  // what follows it came when it was known
  }
  item.entry = std::move(entry);
  items_.push_back(std::move(item));
}

/// The first image of the recording that those before a number end with.
size_t LoggedPoses::beginOfPass(uint64_t before) const {
  size_t begin = 0;
  double newest_s = 0.0;
  bool is_first = true;
  for (size_t i = 0; i < items_.size() && items_[i].entry.head.number < before; ++i) {
    if (!isDepthOfFirst(items_[i])) continue;
    const double stamp_s = items_[i].image.stamp_s;
    if (!is_first && stamp_s < newest_s - kStampsBegin_s) begin = i;
    newest_s = stamp_s;
    is_first = false;
  }
  return begin;
}

CorrectionEffect LoggedPoses::correct(const LogCorrection& correction, bool has_lost_images) {
  const size_t pass = beginOfPass(correction.before);
  std::vector<StampedPose> fused;
  for (size_t i = pass; i < items_.size() && items_[i].entry.head.number < correction.before; ++i) {
    if (isDepthOfFirst(items_[i])) fused.push_back({items_[i].image.stamp_s, items_[i].T_W_C});
  }
  fused = Trajectory(std::move(fused)).poses();  // by stamp, each once
  const PoseCorrection poses(correction.poses, fused);
  const bool reaches_end = has_lost_images && pass == 0;
  if (reaches_end) {
    checkReach(correction, fused.front().stamp_s);
    const StampedPose& first = fused.front();
    if (poses.correct(first.stamp_s, first.T_W_C).matrix() != first.T_W_C.matrix()) {
      throw std::runtime_error(
          "the correction moves the first image that the log holds, and with "
          "it those before, which it no longer has; raise log/max_gb");
    }
  }
  const CorrectionEffect effect = apply(poses, correction, pass);
  newest_ = poses;
  until_s_ = correction.until_s;
  return effect;
}

CorrectionEffect LoggedPoses::apply(const PoseCorrection& poses, const LogCorrection& correction,
                                    size_t pass) {
  CorrectionEffect effect;
  effect.first_moved = correction.before;
  for (size_t i = pass; i < items_.size(); ++i) {
    Item& item = items_[i];
    const bool is_early = item.entry.head.number < correction.before;
    if (!item.is_image || (!is_early && item.image.stamp_s > correction.until_s)) continue;
    const Eigen::Isometry3d T_W_C = poses.correct(item.image.stamp_s, item.T_W_C);
    if (T_W_C.matrix() == item.T_W_C.matrix()) continue;
    item.T_W_C = T_W_C;
    effect.first_moved = std::min(effect.first_moved, item.entry.head.number);
    if (item.entry.head.kind == LogKind::kDepth) ++effect.moved;
  }
  return effect;
}

}  // namespace dtsdf
