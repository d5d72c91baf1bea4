#include "ros/output/status_history.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace dtsdf {
namespace {

constexpr std::chrono::seconds kWindow{30};

bool isFault(DropReason reason) {
  switch (reason) {
    case DropReason::kPaused:
    case DropReason::kOverRate:
    case DropReason::kNotLevel:  // until the first frame is fused, and the status says so then
    case DropReason::kTimeJump:
    case DropReason::kBeforeTransforms: return false;
    default: return true;
  }
}

DropShare shareOf(const FrameCounts& before, const FrameCounts& now) {
  DropShare share;
  share.received = now.images - before.images;
  uint64_t most = 0;
  for (int i = 0; i < kDropReasonCount; ++i) {
    const uint64_t dropped = now.dropped[i] - before.dropped[i];
    const auto reason = static_cast<DropReason>(i);
    if (!isFault(reason)) continue;
    share.dropped += dropped;
    if (dropped > most) {
      most = dropped;
      share.most_common = reason;
    }
  }
  return share;
}

}  // namespace

std::vector<DropShare> RecentDrops::update(const std::vector<CameraReport>& cameras,
                                           SteadyTime now) {
  Moment moment{now, {}};
  for (const CameraReport& camera : cameras) moment.frames.push_back(camera.depth.frames);
  moments_.push_back(std::move(moment));
  while (moments_.size() > 2 && now - moments_[1].at >= kWindow) moments_.pop_front();
  std::vector<DropShare> shares;
  const Moment &first = moments_.front(), &last = moments_.back();
  for (size_t i = 0; i < std::min(first.frames.size(), last.frames.size()); ++i) {
    shares.push_back(shareOf(first.frames[i], last.frames[i]));
  }
  return shares;
}

const char* remedyFor(DropReason reason) {
  switch (reason) {
    case DropReason::kQueueFull:
      return "use larger voxels (map/voxel_size_m), a GPU, or fewer frames";
    case DropReason::kNoTransform:
      return "raise input/tf_timeout_s, or check what publishes the poses";
    case DropReason::kNoCameraInfo:
      return "publish camera_info with the image's stamp, or set input/camera_info: latest";
    case DropReason::kPoseJump:
    case DropReason::kBadPose: return "check the pose estimate, or raise input/max_speed_m_s";
    case DropReason::kOutOfOrder: return "raise input/merge_wait_s";
    case DropReason::kMisfit:
      return "check the pose estimate, or raise poses/sigma_m and poses/sigma_rad";
    case DropReason::kLost:
      return "move the camera back to where it was, and then more slowly; or call set_pose";
    case DropReason::kTooLarge: return "lower the camera's resolution";
    default: return "";
  }
}

}  // namespace dtsdf
