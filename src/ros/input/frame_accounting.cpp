#include "ros/input/frame_accounting.h"

#include <ros/console.h>

#include <numeric>
#include <sstream>

#include "params/printable.h"

namespace dtsdf {
namespace {

constexpr double kWarningPeriod_s = 60.0;

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
  if (reason == DropReason::kPaused || reason == DropReason::kOverRate) return false;  // asked for
  ros::WallTime& last = last_warning_[static_cast<size_t>(reason)];
  const ros::WallTime now = ros::WallTime::now();
  if (!last.isZero() && (now - last).toSec() < kWarningPeriod_s) return false;
  last = now;
  return true;
}

std::optional<double> FrameAccounting::ageOf(const std::optional<SteadyTime>& time) const {
  if (!time) return std::nullopt;
  return std::chrono::duration<double>(clock_() - *time).count();
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
