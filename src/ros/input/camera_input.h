/// Subscribes depth images and their camera_info and pairs them by their exact stamp.
#pragma once

#include <image_transport/image_transport.h>
#include <image_transport/subscriber_filter.h>
#include <message_filters/subscriber.h>
#include <message_filters/sync_policies/exact_time.h>
#include <message_filters/synchronizer.h>
#include <ros/node_handle.h>

#include <functional>
#include <string>

#include "ros/input/frame_accounting.h"

namespace dtsdf {

/// Topics `depth/image_rect` and, unless it is remapped itself, the camera_info beside what that
/// is remapped to.
class CameraInput {
 public:
  using OnFrame = std::function<void(const sensor_msgs::ImageConstPtr&,
                                     const sensor_msgs::CameraInfoConstPtr&)>;

  CameraInput(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
              FrameAccounting& accounting, OnFrame on_frame);

  std::string imageTopic() const { return image_.getTopic(); }
  std::string infoTopic() const { return info_.getTopic(); }
  size_t imagePublishers() const { return image_.getNumPublishers(); }

 private:
  using Policy =
      message_filters::sync_policies::ExactTime<sensor_msgs::Image, sensor_msgs::CameraInfo>;

  void onImage(const sensor_msgs::ImageConstPtr& image);
  void onInfo(const sensor_msgs::CameraInfoConstPtr& info);
  void onPair(const sensor_msgs::ImageConstPtr& image, const sensor_msgs::CameraInfoConstPtr& info);
  void onUnpaired(const sensor_msgs::ImageConstPtr& image,
                  const sensor_msgs::CameraInfoConstPtr& info);

  FrameAccounting& accounting_;
  OnFrame on_frame_;
  image_transport::ImageTransport transport_;
  image_transport::SubscriberFilter image_;
  message_filters::Subscriber<sensor_msgs::CameraInfo> info_;
  message_filters::Synchronizer<Policy> pairing_;
};

}  // namespace dtsdf
