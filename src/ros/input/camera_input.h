/// Subscribes depth images and what belongs to them.
#pragma once

#include <image_transport/image_transport.h>
#include <ros/node_handle.h>
#include <sensor_msgs/CompressedImage.h>

#include <functional>
#include <string>

#include "ros/input/frame_accounting.h"
#include "ros/input/frame_assembly.h"

namespace dtsdf {

/// Topics `depth/image_rect` and, unless it is remapped itself, the camera_info beside what that
/// is remapped to; `mask/image` where masks are wanted. Images come by image_transport; where
/// compressedDepth is asked for and there is no plugin for it, its messages are subscribed and
/// decoded here.
class CameraInput {
 public:
  using OnFrame = FrameAssembly::OnComplete;

  /// `ns` is the namespace of the topics, empty for the root. Not that of `nh`, which for a nodelet
  /// of the root namespace is the one of its manager, such as a camera driver's.
  CameraInput(ros::NodeHandle nh, const ros::NodeHandle& private_nh, const std::string& ns,
              const InputParams& params, FrameAccounting& accounting, OnFrame on_frame);

  /// What `depth/image_rect` is remapped to.
  static std::string depthTopic(const ros::NodeHandle& nh, const std::string& ns);

  std::string imageTopic() const;
  std::string infoTopic() const { return info_.getTopic(); }
  size_t imagePublishers() const;

 private:
  void subscribeDepth(ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                      const std::string& topic);
  bool decodesItself(const std::string& transport) const;
  void onCompressed(const sensor_msgs::CompressedImageConstPtr& message);
  void onDepth(const sensor_msgs::ImageConstPtr& depth);
  void onInfo(const sensor_msgs::CameraInfoConstPtr& info);
  void onMask(const sensor_msgs::ImageConstPtr& mask);
  void onIncomplete(const sensor_msgs::Image& depth, DropReason reason);

  const CameraInfoChoice info_choice_;
  FrameAccounting& accounting_;
  FrameAssembly assembly_;
  image_transport::ImageTransport transport_;
  image_transport::Subscriber by_transport_;  ///< Depth images come by one of these two.
  ros::Subscriber compressed_;
  ros::Subscriber info_, mask_;
};

}  // namespace dtsdf
