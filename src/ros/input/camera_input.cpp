#include "ros/input/camera_input.h"

#include <image_transport/camera_common.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "ros/common/callback_guard.h"
#include "ros/input/compressed_image.h"

namespace dtsdf {
namespace {

/// What overflows here is lost without a word, so this is more than a busy process needs.
constexpr int kSubscriberQueue = 50;

std::string infoTopicFor(const ros::NodeHandle& nh, const std::string& ns,
                         const std::string& image_topic) {
  const std::string name = ns + "/depth/camera_info";
  const std::string remapped = nh.resolveName(name, true);
  if (remapped != name) return remapped;
  return image_transport::getCameraInfoTopic(image_topic);
}

}  // namespace

CameraInput::CameraInput(ros::NodeHandle nh, const ros::NodeHandle& private_nh,
                         const std::string& ns, const InputParams& params,
                         FrameAccounting& accounting, OnFrame on_frame)
    : info_choice_(params.camera_info),
      accounting_(accounting),
      assembly_({params.camera_info, params.mask}, std::move(on_frame),
                [this](const auto& depth, DropReason reason) { onIncomplete(depth, reason); }),
      transport_(nh) {
  const std::string topic = depthTopic(nh, ns);
  info_ = nh.subscribe(infoTopicFor(nh, ns, topic), kSubscriberQueue, &CameraInput::onInfo, this);
  if (params.mask) {
    mask_ = nh.subscribe(ns + "/mask/image", kSubscriberQueue, &CameraInput::onMask, this);
  }
  subscribeDepth(nh, private_nh, topic);
}

void CameraInput::subscribeDepth(ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                                 const std::string& topic) {
  const image_transport::TransportHints hints("raw", ros::TransportHints(), private_nh);
  if (!decodesItself(hints.getTransport())) {
    by_transport_ =
        transport_.subscribe(topic, kSubscriberQueue, &CameraInput::onDepth, this, hints);
    return;
  }
  ROS_INFO_NAMED("dtsdf_mapping",
                 "image_transport has no plugin for compressedDepth: decoded by this node");
  compressed_ = nh.subscribe(topic + kCompressedDepthTopic, kSubscriberQueue,
                             &CameraInput::onCompressed, this);
}

bool CameraInput::decodesItself(const std::string& transport) const {
  if (transport != "compressedDepth") return false;
  const std::vector<std::string> plugins = transport_.getLoadableTransports();
  return std::find(plugins.begin(), plugins.end(), "image_transport/compressedDepth") ==
         plugins.end();
}

std::string CameraInput::depthTopic(const ros::NodeHandle& nh, const std::string& ns) {
  return nh.resolveName(ns + "/depth/image_rect");
}

std::string CameraInput::imageTopic() const {
  return compressed_ ? compressed_.getTopic() : by_transport_.getTopic();
}

size_t CameraInput::imagePublishers() const {
  return compressed_ ? compressed_.getNumPublishers() : by_transport_.getNumPublishers();
}

void CameraInput::onCompressed(const sensor_msgs::CompressedImageConstPtr& message) {
  sensor_msgs::ImageConstPtr depth;
  try {
    depth = decodeDepth(*message);
  } catch (const std::exception& error) {
    guarded("compressed image", [&] {
      accounting_.imageReceived(message->header.stamp);
      accounting_.dropped(DropReason::kBadImage, message->header.stamp, error.what());
    });
    return;
  }
  onDepth(depth);
}

void CameraInput::onDepth(const sensor_msgs::ImageConstPtr& depth) {
  guarded("depth image", [&] {
    accounting_.imageReceived(depth->header.stamp);
    assembly_.addDepth(depth);
  });
}

void CameraInput::onInfo(const sensor_msgs::CameraInfoConstPtr& info) {
  guarded("camera_info", [&] {
    accounting_.cameraInfoReceived();
    assembly_.addInfo(info);
  });
}

void CameraInput::onMask(const sensor_msgs::ImageConstPtr& mask) {
  guarded("mask", [&] { assembly_.addMask(mask); });
}

void CameraInput::onIncomplete(const sensor_msgs::Image& depth, DropReason reason) {
  const bool of_any_stamp =
      reason == DropReason::kNoCameraInfo && info_choice_ == CameraInfoChoice::kLatest;
  const std::string what = reason == DropReason::kNoMask ? "no mask" : "no camera_info";
  const std::string topic = reason == DropReason::kNoMask ? mask_.getTopic() : info_.getTopic();
  accounting_.dropped(reason, depth.header.stamp,
                      what + (of_any_stamp ? "" : " with the same stamp") + " on '" + topic + "'");
}

}  // namespace dtsdf
