#include "ros/input/frame_assembly.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace dtsdf {
namespace {

/// Frames that may be incomplete at a time; beyond, the one that has waited longest is given up.
/// Not that of the oldest stamp: where stamps have gone back, that is the newest.
constexpr size_t kMaxWaiting = 50;

}  // namespace

FrameAssembly::FrameAssembly(Wanted wanted, OnComplete on_complete, OnIncomplete on_incomplete)
    : wanted_(wanted),
      on_complete_(std::move(on_complete)),
      on_incomplete_(std::move(on_incomplete)) {}

FrameMessages& FrameAssembly::at(const ros::Time& stamp) {
  Incomplete& frame = waiting_[stamp];
  if (frame.arrival == 0) frame.arrival = ++arrivals_;
  return frame.messages;
}

void FrameAssembly::addImage(const sensor_msgs::ImageConstPtr& image) {
  at(image->header.stamp).image = image;
  complete(image->header.stamp);
}

void FrameAssembly::addInfo(const sensor_msgs::CameraInfoConstPtr& info) {
  if (wanted_.info == CameraInfoChoice::kLatest) return takeLatest(info);
  at(info->header.stamp).info = info;
  complete(info->header.stamp);
}

void FrameAssembly::addMask(const sensor_msgs::ImageConstPtr& mask) {
  at(mask->header.stamp).mask = mask;
  complete(mask->header.stamp);
}

std::optional<DropReason> FrameAssembly::missingOf(const FrameMessages& frame) const {
  if (wanted_.info == CameraInfoChoice::kExact && !frame.info) return DropReason::kNoCameraInfo;
  if (wanted_.mask && !frame.mask) return DropReason::kNoMask;
  if (wanted_.info == CameraInfoChoice::kLatest && !latest_info_) return DropReason::kNoCameraInfo;
  return std::nullopt;
}

void FrameAssembly::takeLatest(const sensor_msgs::CameraInfoConstPtr& info) {
  const bool is_first = !latest_info_;
  latest_info_ = info;
  if (!is_first) return;
  std::vector<ros::Time> stamps;
  for (const auto& [stamp, frame] : waiting_) stamps.push_back(stamp);
  for (const ros::Time& stamp : stamps) complete(stamp);
}

void FrameAssembly::complete(const ros::Time& stamp) {
  const Waiting::iterator frame = waiting_.find(stamp);
  if (frame == waiting_.end()) return;  // given up meanwhile
  const FrameMessages& there = frame->second.messages;
  if (there.image && !missingOf(there)) {
    while (waiting_.begin() != frame) giveUp(waiting_.begin());
    FrameMessages messages = std::move(frame->second.messages);
    waiting_.erase(frame);
    if (!messages.info) messages.info = latest_info_;
    on_complete_(messages);
  }
  if (waiting_.size() > kMaxWaiting) giveUpFirstArrived();
}

void FrameAssembly::giveUpFirstArrived() {
  giveUp(std::min_element(waiting_.begin(), waiting_.end(), [](const auto& a, const auto& b) {
    return a.second.arrival < b.second.arrival;
  }));
}

void FrameAssembly::giveUp(Waiting::iterator frame) {
  const FrameMessages messages = std::move(frame->second.messages);
  waiting_.erase(frame);
  if (!messages.image) return;  // the others alone are no frame
  on_incomplete_(*messages.image, missingOf(messages).value_or(DropReason::kNoCameraInfo));
}

}  // namespace dtsdf
