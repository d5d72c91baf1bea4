#include "ros/input/camera_input.h"

#include <image_transport/camera_common.h>

#include "ros/common/callback_guard.h"

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
      pairing_(Policy(kPairingQueue), image_, info_) {
  pairing_.registerCallback(&CameraInput::onPair, this);
  pairing_.getPolicy()->registerDropCallback(&CameraInput::onUnpaired, this);
  image_.registerCallback(&CameraInput::onImage, this);
  info_.registerCallback(&CameraInput::onInfo, this);

  const std::string image_topic = nh.resolveName("depth/image_rect");
  ros::NodeHandle info_nh(nh);
  info_.subscribe(info_nh, infoTopicFor(nh, image_topic), kSubscriberQueue);
  image_.subscribe(transport_, image_topic, kSubscriberQueue,
                   image_transport::TransportHints("raw", ros::TransportHints(), private_nh));
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
