#include "ros/input/frame_accounting.h"

#include <ros/console.h>

#include <numeric>
#include <sstream>

#include "params/printable.h"

namespace dtsdf {

namespace {

constexpr double kDropWarningPeriod_s = 60.0;

struct ReasonTexts {
  const char* name;
  bool is_fault;
  const char* remedy = "";
};

/// In the order of DropReason.
constexpr ReasonTexts kReasons[kDropReasonCount] = {
    {"no_camera_info", true},
    {"no_mask", true},
    {"bad_encoding", true},
    {"too_large", true, "lower the camera's resolution"},
    {"bad_image", true},
    {"size_mismatch", true},
    {"bad_intrinsics", true},
    {"no_stamp", true},
    {"bad_stamp", true},
    {"repeated_stamp", true},
    {"long_name", true},
    {"no_transform", true, "raise input/tf_timeout_s, or check what publishes the poses"},
    {"before_transforms", false},
    {"queue_full", true, "use larger voxels (map/voxel_size_m), a GPU, or fewer frames"},
    {"out_of_order", true, "raise input/merge_wait_s"},
    {"time_jump", false},
    {"pose_jump", true, "check the pose estimate, or raise input/max_speed_m_s"},
    {"bad_pose", true, "check the pose estimate, or raise input/max_speed_m_s"},
    {"no_measurement", true},
    {"no_memory", true},
    {"over_rate", false},
    {"not_level", false},  // until the first frame is fused, and the status says so then
    {"misfit", true, "check the pose estimate, or raise poses/sigma_m and poses/sigma_rad"},
    {"lost", true, "move the camera back to where it was, and then more slowly; or call set_pose"},
    {"paused", false},
    {"ending", false},
    {"backend_error", true},
};

const ReasonTexts& textsOf(DropReason reason) { return kReasons[static_cast<size_t>(reason)]; }

}  // namespace

const char* toString(DropReason reason) { return textsOf(reason).name; }

const char* remedyFor(DropReason reason) { return textsOf(reason).remedy; }

bool isFault(DropReason reason) { return textsOf(reason).is_fault; }

DropReason dropReasonOf(FrameStatus status) {
  switch (status) {
    case FrameStatus::kBadIntrinsics: return DropReason::kBadIntrinsics;
    case FrameStatus::kBadPose: return DropReason::kBadPose;
    case FrameStatus::kNoMeasurement: return DropReason::kNoMeasurement;
    case FrameStatus::kNoMemory: return DropReason::kNoMemory;
    case FrameStatus::kBadImage:
    case FrameStatus::kFused: break;
  }
  return DropReason::kBadImage;
}

uint64_t StreamReport::droppedSum() const {
  return std::accumulate(dropped_by.begin(), dropped_by.end(), uint64_t{0});
}

void FrameAccounting::imageReceived(const ros::Time& stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.received;
  counts_.last_stamp = stamp;
  image_at_ = clock_();
}

void FrameAccounting::cameraInfoReceived() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.camera_infos;
  camera_info_at_ = clock_();
}

void FrameAccounting::fused(const ros::Time& stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.fused;
  counts_.last_fused_stamp = stamp;
  fused_at_ = clock_();
}

void FrameAccounting::dropped(const Rejection& rejection, const ros::Time& stamp) {
  std::ostringstream message;
  message.imbue(std::locale::classic());
  message << (name_.empty() ? "" : name_ + ": ") << "frame stamped " << stamp << " dropped ("
          << toString(rejection.reason) << "): " << printableMessage(rejection.text);
  const std::lock_guard<std::mutex> lock(mutex_);
  const uint64_t count = ++counts_.dropped_by[static_cast<size_t>(rejection.reason)];
  counts_.last_drop = message.str();
  if (mayWarn(rejection.reason)) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping",
                          message.str() << " [" << count << " dropped for this reason so far]");
  }
}

bool FrameAccounting::mayWarn(DropReason reason) {
  const bool is_asked_for = reason == DropReason::kPaused || reason == DropReason::kOverRate ||
                            reason == DropReason::kEnding;
  if (is_asked_for) return false;
  ros::WallTime& last = last_warning_[static_cast<size_t>(reason)];
  const ros::WallTime now = ros::WallTime::now();
  if (!last.isZero() && (now - last).toSec() < kDropWarningPeriod_s) return false;
  last = now;
  return true;
}

float FrameAccounting::ageOf(const std::optional<SteadyTime>& time) const {
  return time ? static_cast<float>(toSeconds(clock_() - *time)) : -1.0f;
}

StreamReport FrameAccounting::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  StreamReport counts = counts_;
  counts.waiting = static_cast<uint32_t>(counts.received - counts.fused - counts.droppedSum());
  counts.received_age_s = ageOf(image_at_);
  counts.camera_info_age_s = ageOf(camera_info_at_);
  counts.fused_age_s = ageOf(fused_at_);
  return counts;
}

}  // namespace dtsdf
