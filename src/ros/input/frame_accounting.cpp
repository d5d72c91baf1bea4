#include "ros/input/frame_accounting.h"

#include <ros/console.h>

#include <numeric>
#include <sstream>

#include "params/printable.h"

namespace dtsdf {

const char* toString(DropReason reason) {
  switch (reason) {
    case DropReason::kNoCameraInfo: return "no_camera_info";
    case DropReason::kNoMask: return "no_mask";
    case DropReason::kBadEncoding: return "bad_encoding";
    case DropReason::kTooLarge: return "too_large";
    case DropReason::kBadImage: return "bad_image";
    case DropReason::kSizeMismatch: return "size_mismatch";
    case DropReason::kBadIntrinsics: return "bad_intrinsics";
    case DropReason::kNoStamp: return "no_stamp";
    case DropReason::kBadStamp: return "bad_stamp";
    case DropReason::kRepeatedStamp: return "repeated_stamp";
    case DropReason::kLongName: return "long_name";
    case DropReason::kNoTransform: return "no_transform";
    case DropReason::kBeforeTransforms: return "before_transforms";
    case DropReason::kQueueFull: return "queue_full";
    case DropReason::kOutOfOrder: return "out_of_order";
    case DropReason::kTimeJump: return "time_jump";
    case DropReason::kPoseJump: return "pose_jump";
    case DropReason::kBadPose: return "bad_pose";
    case DropReason::kNoMeasurement: return "no_measurement";
    case DropReason::kNoMemory: return "no_memory";
    case DropReason::kOverRate: return "over_rate";
    case DropReason::kNotLevel: return "not_level";
    case DropReason::kMisfit: return "misfit";
    case DropReason::kLost: return "lost";
    case DropReason::kPaused: return "paused";
    case DropReason::kEnding: return "ending";
    case DropReason::kBackendError: return "backend_error";
  }
  return "unknown";
}

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

namespace {

constexpr double kDropWarningPeriod_s = 60.0;

}  // namespace

uint64_t FrameCounts::droppedSum() const {
  return std::accumulate(dropped.begin(), dropped.end(), uint64_t{0});
}

void FrameAccounting::imageReceived(const ros::Time& stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.images;
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

void FrameAccounting::dropped(DropReason reason, const ros::Time& stamp, const std::string& text) {
  std::ostringstream message;
  message.imbue(std::locale::classic());
  message << (name_.empty() ? "" : name_ + ": ") << "frame stamped " << stamp << " dropped ("
          << toString(reason) << "): " << printableMessage(text);
  const std::lock_guard<std::mutex> lock(mutex_);
  const uint64_t count = ++counts_.dropped[static_cast<size_t>(reason)];
  counts_.last_drop = message.str();
  if (mayWarn(reason)) {
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

std::optional<double> FrameAccounting::ageOf(const std::optional<SteadyTime>& time) const {
  if (!time) return std::nullopt;
  return toSeconds(clock_() - *time);
}

FrameCounts FrameAccounting::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  FrameCounts counts = counts_;
  counts.image_age_s = ageOf(image_at_);
  counts.camera_info_age_s = ageOf(camera_info_at_);
  counts.fused_age_s = ageOf(fused_at_);
  return counts;
}

}  // namespace dtsdf
