/// Subscribes depth images and their camera_info and pairs them by their exact stamp.
#pragma once

#include <image_transport/image_transport.h>
#include <image_transport/subscriber_filter.h>
#include <message_filters/pass_through.h>
#include <message_filters/subscriber.h>
#include <message_filters/sync_policies/exact_time.h>
#include <message_filters/synchronizer.h>
#include <ros/node_handle.h>
#include <sensor_msgs/CompressedImage.h>

#include <functional>
#include <string>

#include "ros/input/frame_accounting.h"

namespace dtsdf {

/// Topics `depth/image_rect` and, unless it is remapped itself, the camera_info beside what that
/// is remapped to. Images come by image_transport; where compressedDepth is asked for and there is
/// no plugin for it, its messages are subscribed and decoded here.
class CameraInput {
 public:
  using OnFrame = std::function<void(const sensor_msgs::ImageConstPtr&,
                                     const sensor_msgs::CameraInfoConstPtr&)>;

  CameraInput(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
              FrameAccounting& accounting, OnFrame on_frame);

  std::string imageTopic() const;
  std::string infoTopic() const { return info_.getTopic(); }
  size_t imagePublishers() const;

 private:
  using Policy =
      message_filters::sync_policies::ExactTime<sensor_msgs::Image, sensor_msgs::CameraInfo>;

  void subscribeImages(ros::NodeHandle nh, const image_transport::TransportHints& hints,
                       const std::string& topic);
  bool decodesItself(const std::string& transport) const;
  void onCompressed(const sensor_msgs::CompressedImageConstPtr& message);
  void onImage(const sensor_msgs::ImageConstPtr& image);
  void onInfo(const sensor_msgs::CameraInfoConstPtr& info);
  void onPair(const sensor_msgs::ImageConstPtr& image, const sensor_msgs::CameraInfoConstPtr& info);
  void onUnpaired(const sensor_msgs::ImageConstPtr& image,
                  const sensor_msgs::CameraInfoConstPtr& info);

  FrameAccounting& accounting_;
  OnFrame on_frame_;
  image_transport::ImageTransport transport_;
  image_transport::SubscriberFilter by_transport_;  ///< One of the two is in use.
  ros::Subscriber compressed_;
  message_filters::PassThrough<sensor_msgs::Image> images_;  ///< From whichever it is.
  message_filters::Subscriber<sensor_msgs::CameraInfo> info_;
  message_filters::Synchronizer<Policy> pairing_;
};

}  // namespace dtsdf
