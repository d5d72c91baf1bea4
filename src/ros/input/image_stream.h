/// Receives and checks the depth or the colour images of a camera, and looks up their poses.
#pragma once

#include <image_transport/camera_common.h>
#include <image_transport/image_transport.h>
#include <ros/console.h>
#include <ros/node_handle.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "dtsdf_mapping/io/rate_limit.h"
#include "level/pose_convention.h"
#include "params/intrinsics_check.h"
#include "params/printable.h"
#include "params/text.h"
#include "ros/common/callback_guard.h"
#include "ros/input/clouds.h"
#include "ros/input/conversions.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/frame_queue.h"
#include "ros/input/images.h"
#include "ros/input/input_status.h"
#include "ros/input/rectification.h"
#include "ros/input/transforms.h"

namespace dtsdf {

/// Subscribes to images, their camera_info and, if masks are used, `mask/image`. Unless camera_info
/// is remapped, its topic is in the namespace of the (remapped) images. Clouds, and images sent by
/// the transport compressed or, for depth, compressedDepth, are decoded here; other images come
/// through image_transport. Used on the input thread only, except report().
class ImageStream {
 public:
  /// `name` is the name of the camera, empty if it is the only one; `camera` is its index. `ns` is
  /// the namespace of the topics, empty for the root. It may differ from the namespace of `nh`,
  /// which for a nodelet in the root namespace is that of its manager. `on_time_jump` is called
  /// when stamps jump back; without it, only this stream restarts. All references must outlive this
  /// object.
  ImageStream(const ImageKind& kind, const std::string& name, size_t camera, const std::string& ns,
              const ros::NodeHandle& nh, const NodeParams& params, Transforms& transforms,
              FrameQueue& queue, std::function<void(const ros::Time&)> on_time_jump = nullptr)
      : kind_(kind),
        name_(name),
        params_(params.input),
        transforms_(transforms),
        queue_(queue),
        on_time_jump_(std::move(on_time_jump)),
        pose_frame_(frameOfPoses(params)),
        camera_(camera),
        is_needed_(kind.is_colour && params.colour == Usage::kAlways),
        nh_(nh),
        mask_topic_(params_.mask && !kind.is_colour ? nh.resolveName(ns + "/mask/image") : ""),
        topic_(ns + "/" + kind.ns + "/image_rect"),
        image_topic_(nh.resolveName(topic_)),
        info_topic_(infoTopic(nh.resolveName(ns + "/" + kind.ns + "/camera_info", false))),
        accounting_(name + (kind.is_colour && !name.empty() ? ", " : "") +
                    (kind.is_colour ? "colour" : "")),
        stream_(queue.addStream(
            kind.is_colour, noInfoText(info_topic_, params_.latest_camera_info),
            mask_topic_.empty() ? std::nullopt : std::make_optional(noMaskText(mask_topic_)),
            accounting_)),
        rate_limit_(kind.is_colour ? params.max_colour_rate_hz : 0.0),
        rectification_(params_.rectify, image_topic_, kind.is_colour),
        cloud_images_(image_topic_),
        transport_(nh) {}

  /// Starts receiving images.
  void subscribe(const ros::NodeHandle& private_nh) {
    // The queue is long, because an overflow is silent: after a stall, roscpp reads everything from
    // one connection before the next, so all images sent during the stall are in the queue at once.
    constexpr int kQueue = 50;
    info_ = nh_.subscribe(info_topic_, kQueue, &ImageStream::onInfo, this);
    if (!mask_topic_.empty()) {
      mask_ = nh_.subscribe(mask_topic_, kQueue, &ImageStream::onMask, this);
    }
    const image_transport::TransportHints hints("raw", ros::TransportHints(), private_nh,
                                                kind_.transport_param);
    const std::string ending = "/" + hints.getTransport();
    if (!kind_.is_colour && hints.getTransport() == kCloudTransport) {
      constexpr int kClouds = 10;  // a cloud is as large as several images
      other_ = nh_.subscribe(topic_, kClouds, &ImageStream::onCloud, this);
      is_cloud_ = true;
    } else if (ending == kind_.compressed_topic || ending == kCompressedTopic) {
      other_ = nh_.subscribe(image_topic_ + ending, kQueue, &ImageStream::onCompressed, this);
    } else {
      by_transport_ = transport_.subscribe(topic_, kQueue, &ImageStream::onImage, this, hints);
    }
  }

  /// Gives frames their poses, and drops frames whose pose can no longer arrive. @return whether a
  /// frame still waits for its pose.
  bool step() {
    bool waits = false;
    const auto decide = [&](const CameraImage& messages, SteadyTime since) {
      FrameQueue::Decision decision = this->decide(messages, since);
      waits = std::holds_alternative<std::string>(decision);
      return decision;
    };
    while (queue_.poseFirst(stream_, decide)) {
    }
    return waits;
  }

  /// Starts over after stamps have jumped back to `stamp`.
  void restartStamps(const ros::Time& stamp) {
    last_stamp_ = ros::Time();
    queue_.restart(stream_, stamp);
  }

  StreamReport report() const {
    StreamReport report = accounting_.counts();
    report.kind = kind_.is_colour ? "color" : "depth";
    report.topic = other_ ? other_.getTopic() : image_topic_;
    report.waiting_for = queue_.waitingFor(stream_);
    report.camera = name_;
    report.is_needed = is_needed_;
    report.info_topic = info_topic_;
    report.is_cloud = is_cloud_;
    report.image_publishers = other_ ? other_.getNumPublishers() : by_transport_.getNumPublishers();
    const std::lock_guard<std::mutex> lock(mutex_);
    report.warning = warning_;
    report.fitted_camera = fitted_camera_;
    return report;
  }

 private:
  std::string infoTopic(const std::string& name) const {
    const std::string remapped = nh_.resolveName(name, true);
    return remapped != name ? remapped : image_transport::getCameraInfoTopic(image_topic_);
  }

  using Received = std::variant<CameraImage, Rejection>;

  /// Counts an image, and queues what `read` makes of it.
  template <class Read>
  void receive(const ros::Time& stamp, const Read& read) {
    guarded("image", [&] {
      accounting_.imageReceived(stamp);
      Received received;
      try {
        received = read();
      } catch (const std::exception& error) {
        received = Rejection{drop::kBadImage, errorText(error)};
      }
      if (const auto* const rejection = std::get_if<Rejection>(&received)) {
        return accounting_.dropped(*rejection, stamp);
      }
      auto& image = std::get<CameraImage>(received);
      if (image.info) accounting_.cameraInfoReceived();
      if (!image.info) image.info = latest_info_;
      queue_.add(stream_, image);
    });
  }

  Received checked(const sensor_msgs::ImageConstPtr& image) const {
    if (const auto rejection = checkArrival(*image, queue_.maxBytes())) return *rejection;
    return CameraImage{image};
  }

  void onCompressed(const sensor_msgs::CompressedImageConstPtr& message) {
    receive(message->header.stamp, [&] { return checked(kind_.decode(*message)); });
  }
  void onImage(const sensor_msgs::ImageConstPtr& image) {
    receive(image->header.stamp, [&] { return checked(image); });
  }
  /// If nobody publishes camera_info when the first cloud arrives, the fitted camera is always
  /// used.
  void onCloud(const sensor_msgs::PointCloud2ConstPtr& cloud) {
    receive(cloud->header.stamp, [&] {
      if (!has_info_) has_info_ = findPublishedTopics().count(info_topic_) > 0;
      if (!*has_info_) info_.shutdown();
      Received received = cloud_images_.convert(*cloud, *has_info_, queue_.maxBytes());
      const std::lock_guard<std::mutex> lock(mutex_);
      fitted_camera_ = cloud_images_.camera();
      return received;
    });
  }

  void onInfo(const sensor_msgs::CameraInfoConstPtr& info) {
    guarded("camera_info", [&] {
      accounting_.cameraInfoReceived();
      const std::string problem = findProblem(*info);
      if (!problem.empty()) {
        ROS_WARN_STREAM_THROTTLE_NAMED(
            5.0, "dtsdf_mapping", "camera_info on '" << info_topic_ << "' is ignored: " << problem);
      } else if (params_.latest_camera_info) {
        latest_info_ = info;
        queue_.addToWaiting(stream_, info);
      } else {
        queue_.add(stream_, {nullptr, info});
      }
    });
  }

  void onMask(const sensor_msgs::ImageConstPtr& mask) {
    guarded("mask", [&] {
      const auto rejection = checkArrival(*mask, queue_.maxBytes());
      if (!rejection) return queue_.add(stream_, {nullptr, nullptr, mask});
      ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping",
                                     "a mask is ignored: " << rejection->text);
    });
  }

  /// Called again while the frame waits for its pose.
  FrameQueue::Decision decide(const CameraImage& messages, SteadyTime since) {
    const sensor_msgs::Image& image = *messages.image;
    const ros::Time stamp = image.header.stamp;
    if (const auto rejection = check(messages)) return *rejection;
    handleTimeJump(stamp);
    PoseAnswer pose{Eigen::Isometry3d::Identity()};
    if (!pose_frame_.empty()) {
      pose = transforms_.find(pose_frame_, cameraFrame(image), stamp);
    }
    const auto waited = waitingTime() - since;
    if (pose.may_come && waited < toSteadyDuration(params_.tf_timeout_s)) return pose.text;
    transforms_.recordLookUp(pose.T_W_C.has_value());
    if (pose.may_come) {
      return Rejection{
          drop::kNoTransform,
          pose.text + formatted("; waited %g s (input/tf_timeout_s)", params_.tf_timeout_s)};
    }
    if (!pose.T_W_C) return Rejection{drop::kBeforeTransforms, pose.text};
    const double stamp_s = stamp.toSec();
    const auto last = std::exchange(last_pose_, std::make_pair(stamp_s, *pose.T_W_C));
    if (last && last->first == stamp_s) return Rejection{drop::kRepeatedStamp, kRepeatedStampText};
    if (!rate_limit_.takes(stamp_s)) {
      return Rejection{drop::kOverRate, "the rate is above colour/max_rate_hz"};
    }
    const auto jump =
        findJump(last, stamp_s, *pose.T_W_C, params_.max_speed_m_s, params_.max_turn_deg_s);
    if (jump) return Rejection{drop::kPoseJump, *jump};
    return makePosed(messages, *pose.T_W_C);
  }

  std::optional<Rejection> check(const CameraImage& frame) const {
    if (auto rejection = kind_.check(frame)) return rejection;
    if (cameraFrame(*frame.image).empty()) {
      return Rejection{
          drop::kNoTransform,
          "the image has no frame_id; set it in the driver, or set input/camera_frame"};
    }
    return std::nullopt;
  }

  std::string cameraFrame(const sensor_msgs::Image& image) const {
    const bool is_given = !kind_.is_colour && !params_.camera_frame.empty();
    return is_given ? params_.camera_frame : stripLeadingSlash(image.header.frame_id);
  }

  void handleTimeJump(const ros::Time& stamp) {
    const ros::Time last = last_stamp_;
    last_stamp_ = std::max(last, stamp);
    if (last.isZero() || last.toSec() - stamp.toSec() < kTimeJump_s) return;
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", "the images' stamps went back from "
                                               << last << " to " << stamp
                                               << ": waiting frames are discarded, the map is kept "
                                                  "(clear_map empties it)");
    on_time_jump_ ? on_time_jump_(stamp) : restartStamps(stamp);
    last_stamp_ = stamp;
  }

  FrameQueue::Decision makePosed(const CameraImage& messages, const Eigen::Isometry3d& T_W_C) {
    PosedFrame posed;
    posed.stamp = messages.image->header.stamp;
    posed.frame_id = cameraFrame(*messages.image);
    posed.camera = camera_;
    try {
      posed.image = rectification_.frameOf(messages, is_cloud_, params_, posed.pixels);
    } catch (const std::exception& error) {  // from OpenCV or cv_bridge, or no memory for a copy
      return Rejection{drop::kBadImage, errorText(error)};
    }
    std::visit([&](auto& image) { image.T_W_C = T_W_C; }, posed.image);
    updateWarning(posed);
    return posed;
  }

  void updateWarning(const PosedFrame& posed) {
    std::string text = rectification_.warning();
    if (const auto* depth = std::get_if<DepthFrame>(&posed.image)) {
      convention_.add(*depth);
      if (!convention_.doubt().empty()) text = convention_.doubt();
    }
    if (text.empty()) {
      text = std::visit(
          [](const auto& image) { return doubtAbout(image.intrinsics, image.width, image.height); },
          posed.image);
    }
    if (!text.empty()) text = "'" + printable(posed.frame_id) + "': " + text;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (std::exchange(warning_, text) != text && !text.empty()) {
      ROS_WARN_STREAM_NAMED("dtsdf_mapping", text);
    }
  }

  const ImageKind& kind_;
  const std::string name_;  ///< Name of the camera.
  const InputParams& params_;
  Transforms& transforms_;
  FrameQueue& queue_;
  const std::function<void(const ros::Time&)> on_time_jump_;
  const std::string pose_frame_;  ///< Frame to look up poses in; empty: poses are not looked up.
  const size_t camera_;
  const bool is_needed_;
  ros::NodeHandle nh_;
  const std::string mask_topic_;  ///< Empty if masks are not used.
  const std::string topic_;       ///< Topic of the images, before remapping.
  const std::string image_topic_, info_topic_;
  FrameAccounting accounting_;
  FrameQueue::Stream stream_;
  sensor_msgs::CameraInfoConstPtr latest_info_;  ///< Set if input/camera_info is latest.
  RateLimit rate_limit_;
  std::optional<std::pair<double, Eigen::Isometry3d>> last_pose_;  ///< Last pose, with its stamp.
  Rectification rectification_;
  CloudImages cloud_images_;
  bool is_cloud_ = false;         ///< Set by subscribe().
  std::optional<bool> has_info_;  ///< Whether clouds come with a camera_info, once known.
  PoseConvention convention_;
  ros::Time last_stamp_;

  mutable std::mutex mutex_;  ///< Guards the texts below.
  std::string warning_, fitted_camera_;

  image_transport::ImageTransport transport_;
  image_transport::Subscriber by_transport_;  ///< Images come through this or `other_`.
  ros::Subscriber other_;
  ros::Subscriber info_, mask_;
};

}  // namespace dtsdf
