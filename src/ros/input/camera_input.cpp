#include "ros/input/camera_input.h"

#include <image_transport/camera_common.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "params/printable.h"
#include "ros/common/callback_guard.h"
#include "ros/input/images.h"

namespace dtsdf {
namespace {

/// What overflows here is lost without a word, so this is more than a busy process needs. After a
/// stall, roscpp reads all that has come by one connection before it reads the next: so as many
/// images wait at once as were sent meanwhile, however promptly each is taken.
constexpr int kSubscriberQueue = 50;

std::string infoTopicFor(const ros::NodeHandle& nh, const std::string& name,
                         const std::string& image_topic) {
  std::string remapped = nh.resolveName(name, true);
  if (remapped != name) return remapped;
  return image_transport::getCameraInfoTopic(image_topic);
}

}  // namespace

CameraInput::CameraInput(const ImageKind& kind, ros::NodeHandle nh,
                         const ros::NodeHandle& private_nh, const std::string& ns,
                         const InputParams& params, FrameAccounting& accounting, Handlers handlers)
    : kind_(kind),
      info_choice_(params.camera_info),
      most_bytes_(queueBytesOf(params)),
      accounting_(accounting),
      on_waiting_(std::move(handlers.on_waiting)),
      assembly_({params.camera_info, params.mask},
                {static_cast<size_t>(params.queue_size), most_bytes_}, std::move(handlers.on_frame),
                [this](const auto& image, DropReason reason) { onIncomplete(image, reason); }),
      transport_(nh) {
  const std::string topic = imageTopic(nh, ns, kind_);
  info_ = nh.subscribe(infoTopicFor(nh, ns + "/" + kind_.info_topic, topic), kSubscriberQueue,
                       &CameraInput::onInfo, this);
  if (params.mask) {
    mask_ = nh.subscribe(ns + "/mask/image", kSubscriberQueue, &CameraInput::onMask, this);
  }
  subscribeImages(nh, private_nh, topic);
}

void CameraInput::subscribeImages(ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                                  const std::string& topic) {
  const image_transport::TransportHints hints("raw", ros::TransportHints(), private_nh,
                                              kind_.transport_param);
  if (!decodesItself(hints.getTransport())) {
    by_transport_ =
        transport_.subscribe(topic, kSubscriberQueue, &CameraInput::onImage, this, hints);
    return;
  }
  ROS_INFO_STREAM_NAMED("dtsdf_mapping", "image_transport has no plugin for "
                                             << kind_.own_transport << ": decoded by this node");
  compressed_ = nh.subscribe(topic + "/" + kind_.own_transport, kSubscriberQueue,
                             &CameraInput::onCompressed, this);
}

bool CameraInput::decodesItself(const std::string& transport) const {
  if (transport != kind_.own_transport) return false;
  const std::vector<std::string> plugins = transport_.getLoadableTransports();
  return std::find(plugins.begin(), plugins.end(), "image_transport/" + transport) == plugins.end();
}

std::string CameraInput::imageTopic(const ros::NodeHandle& nh, const std::string& ns,
                                    const ImageKind& kind) {
  return nh.resolveName(ns + "/" + kind.image_topic);
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
    image = kind_.decode(*message);
  } catch (const std::exception& error) {
    guarded("compressed image", [&] {
      accounting_.imageReceived(message->header.stamp);
      accounting_.dropped(DropReason::kBadImage, message->header.stamp, errorText(error));
    });
    return;
  }
  onImage(image);
}

void CameraInput::onImage(const sensor_msgs::ImageConstPtr& image) {
  guarded("image", [&] {
    accounting_.imageReceived(image->header.stamp);
    if (const auto rejection = checkArrival(*image, most_bytes_)) {
      return accounting_.dropped(rejection->reason, image->header.stamp, rejection->text);
    }
    assembly_.addImage(image);
    on_waiting_();
  });
}

void CameraInput::onInfo(const sensor_msgs::CameraInfoConstPtr& info) {
  guarded("camera_info", [&] {
    accounting_.cameraInfoReceived();
    assembly_.addInfo(info);
  });
}

void CameraInput::onMask(const sensor_msgs::ImageConstPtr& mask) {
  guarded("mask", [&] {
    assembly_.addMask(mask);
    on_waiting_();
  });
}

std::string CameraInput::describeMissing(DropReason reason) const {
  const bool is_mask = reason == DropReason::kNoMask;
  const bool of_any_stamp = !is_mask && info_choice_ == CameraInfoChoice::kLatest;
  return std::string(is_mask ? "no mask" : "no camera_info") +
         (of_any_stamp ? "" : " with the same stamp") + " on '" +
         (is_mask ? mask_ : info_).getTopic() + "'";
}

std::string CameraInput::waitingFor() const {
  const size_t images = waitingImages();
  if (images == 0) return "";
  const std::string also = mask_ ? " or a mask on '" + mask_.getTopic() + "'" : "";
  return (images == 1 ? "1 image waits" : std::to_string(images) + " images wait") +
         std::string(" for camera_info on '") + info_.getTopic() + "'" + also;
}

void CameraInput::onIncomplete(const sensor_msgs::Image& image, DropReason reason) {
  std::string text = describeMissing(reason);
  if (reason == DropReason::kQueueFull) {
    text =
        "waiting images exceed input/queue_mb (" + describeMissing(DropReason::kNoCameraInfo) + ")";
  }
  accounting_.dropped(reason, image.header.stamp, text);
}

}  // namespace dtsdf
