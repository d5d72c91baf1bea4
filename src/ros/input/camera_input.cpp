#include "ros/input/camera_input.h"

#include <image_transport/camera_common.h>

#include <algorithm>
#include <vector>

#include "ros/common/callback_guard.h"
#include "ros/input/compressed_image.h"

namespace dtsdf {
namespace {

/// What overflows here is lost without a word, so this is more than a busy process needs.
constexpr int kSubscriberQueue = 50;
/// Pairs that may be incomplete at a time; beyond, the oldest image is given up.
constexpr int kPairingQueue = 50;

std::string infoTopicFor(const ros::NodeHandle& nh, const std::string& image_topic) {
  const std::string name = "depth/camera_info";
  const std::string remapped = nh.resolveName(name, true);
  if (remapped != nh.resolveName(name, false)) return remapped;
  return image_transport::getCameraInfoTopic(image_topic);
}

}  // namespace

CameraInput::CameraInput(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                         FrameAccounting& accounting, OnFrame on_frame)
    : accounting_(accounting),
      on_frame_(std::move(on_frame)),
      transport_(nh),
      pairing_(Policy(kPairingQueue), images_, info_) {
  pairing_.registerCallback(&CameraInput::onPair, this);
  pairing_.getPolicy()->registerDropCallback(&CameraInput::onUnpaired, this);
  images_.registerCallback(&CameraInput::onImage, this);
  info_.registerCallback(&CameraInput::onInfo, this);

  const std::string image_topic = nh.resolveName("depth/image_rect");
  ros::NodeHandle info_nh(nh);
  info_.subscribe(info_nh, infoTopicFor(nh, image_topic), kSubscriberQueue);
  subscribeImages(nh, image_transport::TransportHints("raw", ros::TransportHints(), private_nh),
                  image_topic);
}

void CameraInput::subscribeImages(ros::NodeHandle nh, const image_transport::TransportHints& hints,
                                  const std::string& topic) {
  if (decodesItself(hints.getTransport())) {
    ROS_INFO_NAMED("dtsdf_mapping",
                   "image_transport has no plugin for compressedDepth: decoded by this node");
    compressed_ = nh.subscribe(topic + kCompressedDepthTopic, kSubscriberQueue,
                               &CameraInput::onCompressed, this);
    return;
  }
  images_.connectInput(by_transport_);
  by_transport_.subscribe(transport_, topic, kSubscriberQueue, hints);
}

bool CameraInput::decodesItself(const std::string& transport) const {
  if (transport != "compressedDepth") return false;
  const std::vector<std::string> plugins = transport_.getLoadableTransports();
  return std::find(plugins.begin(), plugins.end(), "image_transport/compressedDepth") ==
         plugins.end();
}

std::string CameraInput::imageTopic() const {
  return compressed_ ? compressed_.getTopic() : by_transport_.getTopic();
}

size_t CameraInput::imagePublishers() const {
  return compressed_ ? compressed_.getNumPublishers() : by_transport_.getNumPublishers();
}

void CameraInput::onCompressed(const sensor_msgs::CompressedImageConstPtr& message) {
  sensor_msgs::ImageConstPtr image;
  try {
    image = decodeDepth(*message);
  } catch (const std::exception& error) {
    guarded("compressed image", [&] {
      accounting_.imageReceived();
      accounting_.dropped(DropReason::kBadImage, message->header.stamp, error.what());
    });
    return;
  }
  images_.add(image);
}

void CameraInput::onImage(const sensor_msgs::ImageConstPtr&) { accounting_.imageReceived(); }

void CameraInput::onInfo(const sensor_msgs::CameraInfoConstPtr&) {
  accounting_.cameraInfoReceived();
}

void CameraInput::onPair(const sensor_msgs::ImageConstPtr& image,
                         const sensor_msgs::CameraInfoConstPtr& info) {
  guarded("depth image", [&] { on_frame_(image, info); });
}

void CameraInput::onUnpaired(const sensor_msgs::ImageConstPtr& image,
                             const sensor_msgs::CameraInfoConstPtr&) {
  if (!image) return;  // a camera_info alone is no frame
  guarded("unpaired image", [&] {
    accounting_.dropped(DropReason::kNoCameraInfo, image->header.stamp,
                        "no camera_info with the same stamp on '" + info_.getTopic() + "'");
  });
}

}  // namespace dtsdf
