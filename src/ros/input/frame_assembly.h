/// Puts together what belongs to one image: its camera_info and, where there are masks, its
/// mask.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>

#include "params/node_params.h"
#include "ros/input/frame_accounting.h"

namespace dtsdf {

struct FrameMessages {
  sensor_msgs::ImageConstPtr image;
  sensor_msgs::CameraInfoConstPtr info;
  sensor_msgs::ImageConstPtr mask;  ///< Only where masks are wanted.
};

/// Messages with one stamp make a frame, in any order of arrival. A frame that is complete gives up
/// those before it that are not. Where the latest camera_info will do, images before the first one
/// wait for it. What waits is bounded, in images and in bytes of all messages. On one thread at a
/// time, but for what it reports.
class FrameAssembly {
 public:
  struct Wanted {
    CameraInfoChoice info = CameraInfoChoice::kExact;
    bool mask = false;
  };
  struct Room {
    size_t images = 50;
    size_t bytes = std::numeric_limits<size_t>::max();
  };
  using OnComplete = std::function<void(const FrameMessages&)>;
  /// Of an image that is given up, and why.
  using OnIncomplete = std::function<void(const sensor_msgs::Image&, DropReason)>;

  FrameAssembly(Wanted wanted, Room room, OnComplete on_complete, OnIncomplete on_incomplete);

  void addImage(const sensor_msgs::ImageConstPtr& image);
  void addInfo(const sensor_msgs::CameraInfoConstPtr& info);
  void addMask(const sensor_msgs::ImageConstPtr& mask);

  /// Gives up the image that has waited longest; false if none waits. Without a reason: for what it
  /// lacks.
  bool giveUpImage(std::optional<DropReason> reason);

  /// Any thread: images that wait, and the bytes of all messages that do.
  size_t waitingImages() const { return images_; }
  size_t waitingBytes() const { return bytes_; }

 private:
  struct Incomplete {
    FrameMessages messages;
    uint64_t arrival = 0;  ///< Of its first message; 0: none has come yet.
  };
  using Waiting = std::map<ros::Time, Incomplete>;

  /// The messages of a stamp, to which one more is added.
  FrameMessages& at(const ros::Time& stamp);
  /// Adds a message to those of its stamp, in place of one that is there.
  template <class Message>
  void add(const Message& message, Message FrameMessages::*part, size_t images = 0);

  void takeLatest(const sensor_msgs::CameraInfoConstPtr& info);
  void complete(const ros::Time& stamp);
  /// What keeps a frame from being complete; kNoCameraInfo before kNoMask.
  std::optional<DropReason> missingOf(const FrameMessages& frame) const;
  FrameMessages take(Waiting::iterator frame);
  void giveUp(Waiting::iterator frame, std::optional<DropReason> reason = std::nullopt);
  Waiting::iterator firstArrived(bool with_image);
  void makeRoom();

  const Wanted wanted_;
  const Room room_;
  OnComplete on_complete_;
  OnIncomplete on_incomplete_;
  Waiting waiting_;
  uint64_t arrivals_ = 0;
  std::atomic<size_t> images_{0}, bytes_{0};  ///< Of what waits.
  sensor_msgs::CameraInfoConstPtr latest_info_;
};

}  // namespace dtsdf
