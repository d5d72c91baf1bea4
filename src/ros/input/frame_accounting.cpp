#include "ros/input/frame_accounting.h"

#include <ros/console.h>

#include <numeric>
#include <sstream>

namespace dtsdf {
namespace {

constexpr double kWarningPeriod_s = 5.0;

}  // namespace

uint64_t FrameCounts::droppedSum() const {
  return std::accumulate(dropped.begin(), dropped.end(), uint64_t{0});
}

void FrameAccounting::imageReceived() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.images;
}

void FrameAccounting::cameraInfoReceived() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.camera_infos;
}

void FrameAccounting::fused(const ros::Time& stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.fused;
  counts_.last_fused_stamp = stamp;
}

void FrameAccounting::dropped(DropReason reason, const ros::Time& stamp, const std::string& text) {
  std::ostringstream message;
  message << "frame of " << stamp << " dropped (" << toString(reason) << "): " << text;
  const std::lock_guard<std::mutex> lock(mutex_);
  const uint64_t count = ++counts_.dropped[static_cast<size_t>(reason)];
  counts_.last_drop = message.str();
  if (mayWarn(reason)) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping",
                          message.str() << " [" << count << " dropped for this reason so far]");
  }
}

bool FrameAccounting::mayWarn(DropReason reason) {
  if (reason == DropReason::kPaused) return false;  // asked for
  ros::WallTime& last = last_warning_[static_cast<size_t>(reason)];
  const ros::WallTime now = ros::WallTime::now();
  if (!last.isZero() && (now - last).toSec() < kWarningPeriod_s) return false;
  last = now;
  return true;
}

FrameCounts FrameAccounting::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counts_;
}

}  // namespace dtsdf
