#include "ros/input/frame_assembly.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace dtsdf {
namespace {

/// Stamps that may wait at a time, also those without an image, as where camera_info comes by
/// another connection and images are late. Beyond, the one that has waited longest is given up. Not
/// that of the oldest stamp: where stamps have gone back, that is the newest.
constexpr size_t kMostStamps = 50;

size_t bytesOf(const sensor_msgs::ImageConstPtr& image) {
  return image ? image->data.size() + image->encoding.size() + image->header.frame_id.size() : 0;
}

size_t bytesOf(const sensor_msgs::CameraInfoConstPtr& info) {
  return info ? info->D.size() * sizeof(double) + info->distortion_model.size() +
                    info->header.frame_id.size()
              : 0;
}

size_t bytesOf(const FrameMessages& frame) {
  return bytesOf(frame.image) + bytesOf(frame.info) + bytesOf(frame.mask);
}

}  // namespace

FrameAssembly::FrameAssembly(Wanted wanted, Room room, OnComplete on_complete,
                             OnIncomplete on_incomplete)
    : wanted_(wanted),
      room_(room),
      on_complete_(std::move(on_complete)),
      on_incomplete_(std::move(on_incomplete)) {}

FrameMessages& FrameAssembly::at(const ros::Time& stamp) {
  Incomplete& frame = waiting_[stamp];
  if (frame.arrival == 0) frame.arrival = ++arrivals_;
  return frame.messages;
}

template <class Message>
void FrameAssembly::add(const Message& message, Message FrameMessages::*part, size_t images) {
  const ros::Time stamp = message->header.stamp;
  Message& place = at(stamp).*part;
  bytes_ += bytesOf(message);
  bytes_ -= bytesOf(place);
  place = message;
  images_ += images;
  complete(stamp);
  makeRoom();
}

void FrameAssembly::addImage(const sensor_msgs::ImageConstPtr& image) {
  const Waiting::iterator same = waiting_.find(image->header.stamp);
  if (same != waiting_.end() && same->second.messages.image) giveUp(same);  // two of one stamp
  add(image, &FrameMessages::image, 1);
}

void FrameAssembly::addInfo(const sensor_msgs::CameraInfoConstPtr& info) {
  if (wanted_.info == CameraInfoChoice::kLatest) return takeLatest(info);
  add(info, &FrameMessages::info);
}

void FrameAssembly::addMask(const sensor_msgs::ImageConstPtr& mask) {
  add(mask, &FrameMessages::mask);
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
  if (!there.image || missingOf(there)) return;
  while (waiting_.begin() != frame) giveUp(waiting_.begin());
  FrameMessages messages = take(frame);
  if (!messages.info) messages.info = latest_info_;
  on_complete_(messages);
}

void FrameAssembly::makeRoom() {
  while (images_ > room_.images) giveUp(firstArrived(true));
  while (waiting_.size() > std::max(kMostStamps, room_.images)) giveUp(firstArrived(false));
  while (bytes_ > room_.bytes) giveUp(firstArrived(false), DropReason::kQueueFull);
}

bool FrameAssembly::giveUpImage(std::optional<DropReason> reason) {
  if (images_ == 0) return false;
  giveUp(firstArrived(true), reason);
  return true;
}

FrameAssembly::Waiting::iterator FrameAssembly::firstArrived(bool with_image) {
  const auto rank = [&](const auto& entry) {
    return std::make_pair(with_image && !entry.second.messages.image, entry.second.arrival);
  };
  return std::min_element(waiting_.begin(), waiting_.end(),
                          [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
}

FrameMessages FrameAssembly::take(Waiting::iterator frame) {
  FrameMessages messages = std::move(frame->second.messages);
  waiting_.erase(frame);
  bytes_ -= bytesOf(messages);
  if (messages.image) --images_;
  return messages;
}

void FrameAssembly::giveUp(Waiting::iterator frame, std::optional<DropReason> reason) {
  const FrameMessages messages = take(frame);
  if (!messages.image) return;  // the others alone are no frame
  if (!reason) reason = missingOf(messages).value_or(DropReason::kNoCameraInfo);
  on_incomplete_(*messages.image, *reason);
}

}  // namespace dtsdf
