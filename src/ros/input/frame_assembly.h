/// Puts together what belongs to one image: its camera_info and, where there are masks, its
/// mask.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <cstdint>
#include <functional>
#include <map>
#include <optional>

#include "params/node_params.h"
#include "ros/input/drop_reason.h"

namespace dtsdf {

struct FrameMessages {
  sensor_msgs::ImageConstPtr image;
  sensor_msgs::CameraInfoConstPtr info;
  sensor_msgs::ImageConstPtr mask;  ///< Only where masks are wanted.
};

/// Messages with one stamp make a frame, in any order of arrival. A frame that is complete gives up
/// those before it that are not. Where the latest camera_info will do, images before the first one
/// wait for it. On one thread at a time.
class FrameAssembly {
 public:
  struct Wanted {
    CameraInfoChoice info = CameraInfoChoice::kExact;
    bool mask = false;
  };
  using OnComplete = std::function<void(const FrameMessages&)>;
  /// Of an image that is given up, and why.
  using OnIncomplete = std::function<void(const sensor_msgs::Image&, DropReason)>;

  FrameAssembly(Wanted wanted, OnComplete on_complete, OnIncomplete on_incomplete);

  void addImage(const sensor_msgs::ImageConstPtr& image);
  void addInfo(const sensor_msgs::CameraInfoConstPtr& info);
  void addMask(const sensor_msgs::ImageConstPtr& mask);

 private:
  struct Incomplete {
    FrameMessages messages;
    uint64_t arrival = 0;  ///< Of its first message; 0: none has come yet.
  };
  using Waiting = std::map<ros::Time, Incomplete>;

  /// The messages of a stamp, to which one more is added.
  FrameMessages& at(const ros::Time& stamp);

  void takeLatest(const sensor_msgs::CameraInfoConstPtr& info);
  void complete(const ros::Time& stamp);
  /// What keeps a frame from being complete; kNoCameraInfo before kNoMask.
  std::optional<DropReason> missingOf(const FrameMessages& frame) const;
  void giveUp(Waiting::iterator frame);
  void giveUpFirstArrived();

  Wanted wanted_;
  OnComplete on_complete_;
  OnIncomplete on_incomplete_;
  Waiting waiting_;
  uint64_t arrivals_ = 0;
  sensor_msgs::CameraInfoConstPtr latest_info_;
};

}  // namespace dtsdf
