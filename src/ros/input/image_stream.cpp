#include "ros/input/image_stream.h"

#include <image_transport/camera_common.h>
#include <ros/console.h>
#include <boost/make_shared.hpp>

#include <algorithm>
#include <exception>
#include <utility>

#include "level/frame_points.h"
#include "params/intrinsics_check.h"
#include "params/printable.h"
#include "params/text.h"
#include "ros/common/callback_guard.h"
#include "ros/input/conversions.h"
#include "ros/input/images.h"

namespace dtsdf {
namespace {

/// What overflows here is lost without a word, so this is more than a busy process needs. After a
/// stall, roscpp reads all that has come by one connection before it reads the next: so as many
/// images wait at once as were sent meanwhile, however promptly each is taken.
constexpr int kSubscriberQueue = 50;
/// A stamp further ahead of the last may be wrong, or come after a gap: the next one shows which.
constexpr double kGap_s = 30.0;

std::string infoTopicFor(const ros::NodeHandle& nh, const std::string& name,
                         const std::string& image_topic) {
  std::string remapped = nh.resolveName(name, true);
  if (remapped != name) return remapped;
  return image_transport::getCameraInfoTopic(image_topic);
}

FrameQueue::StreamOptions queueOptions(const ImageKind& kind, const std::string& name,
                                       const InputParams& params, const std::string& info_topic,
                                       const std::string& mask_topic) {
  const bool any_info = params.camera_info == CameraInfoChoice::kLatest;
  return {name,
          kind.is_colour,
          any_info,
          params.mask && !kind.is_colour,
          noInfoText(info_topic, any_info),
          noMaskText(mask_topic)};
}

std::string accountingName(const ImageKind& kind, const std::string& name) {
  if (!kind.is_colour) return name;
  return name.empty() ? "colour" : name + ", colour";
}

}  // namespace

ImageStream::ImageStream(const ImageKind& kind, const std::string& name, size_t camera,
                         const std::string& ns, const ros::NodeHandle& nh, const NodeParams& params,
                         Transforms& transforms, FrameQueue& queue,
                         std::function<void(const ros::Time&)> on_time_jump)
    : kind_(kind),
      name_(name),
      params_(params.input),
      transforms_(transforms),
      queue_(queue),
      on_time_jump_(std::move(on_time_jump)),
      pose_frame_(frameOfPoses(params)),
      camera_(camera),
      is_needed_(kind_.is_colour && params.colour.enabled == ColourUse::kAlways),
      nh_(nh),
      ns_(ns),
      topic_(ns + "/" + kind_.ns + "/image_rect"),
      image_topic_(nh.resolveName(topic_)),
      info_topic_(infoTopicFor(nh, nh.resolveName(ns + "/" + kind_.ns + "/camera_info", false),
                               image_topic_)),
      accounting_(accountingName(kind_, name)),
      stream_(queue_.addStream(
          queueOptions(kind_, name, params_, info_topic_, nh.resolveName(ns + "/mask/image")),
          accounting_)),
      rate_limit_(kind_.is_colour ? params.colour.max_rate_hz : 0.0),
      motion_gate_(params_.max_speed_m_s, params_.max_turn_deg_s),
      rectification_(params_.rectify, image_topic_, kind_.is_colour),
      transport_(nh) {}

void ImageStream::subscribe(const ros::NodeHandle& private_nh) {
  info_ = nh_.subscribe(info_topic_, kSubscriberQueue, &ImageStream::onInfo, this);
  if (params_.mask && !kind_.is_colour) {
    mask_ = nh_.subscribe(ns_ + "/mask/image", kSubscriberQueue, &ImageStream::onMask, this);
  }
  const image_transport::TransportHints hints("raw", ros::TransportHints(), private_nh,
                                              kind_.transport_param);
  const std::string ending = "/" + hints.getTransport();
  if (ending == kind_.compressed_topic || ending == kCompressedTopic) {
    compressed_ =
        nh_.subscribe(image_topic_ + ending, kSubscriberQueue, &ImageStream::onCompressed, this);
  } else {
    by_transport_ =
        transport_.subscribe(topic_, kSubscriberQueue, &ImageStream::onImage, this, hints);
  }
}

void ImageStream::onCompressed(const sensor_msgs::CompressedImageConstPtr& message) {
  sensor_msgs::ImageConstPtr image;
  try {
    image = kind_.decode(*message);
  } catch (const std::exception& error) {
    guarded("compressed image", [&] {
      accounting_.imageReceived(message->header.stamp);
      accounting_.dropped({DropReason::kBadImage, errorText(error)}, message->header.stamp);
    });
    return;
  }
  onImage(image);
}

void ImageStream::onImage(const sensor_msgs::ImageConstPtr& image) {
  guarded("image", [&] {
    const ros::Time stamp = image->header.stamp;
    accounting_.imageReceived(stamp);
    if (const auto rejection = checkArrival(*image, queue_.maxBytes())) {
      return accounting_.dropped(*rejection, stamp);
    }
    queue_.addImage(stream_, image);
  });
}

void ImageStream::onInfo(const sensor_msgs::CameraInfoConstPtr& info) {
  guarded("camera_info", [&] {
    accounting_.cameraInfoReceived();
    const std::string problem = findProblem(*info);
    if (problem.empty()) return queue_.addInfo(stream_, info);
    ROS_WARN_STREAM_THROTTLE_NAMED(
        5.0, "dtsdf_mapping", "camera_info on '" << info_topic_ << "' is ignored: " << problem);
  });
}

void ImageStream::onMask(const sensor_msgs::ImageConstPtr& mask) {
  guarded("mask", [&] {
    const auto rejection = checkArrival(*mask, queue_.maxBytes());
    if (!rejection) return queue_.addMask(stream_, mask);
    ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping", "a mask is ignored: " << rejection->text);
  });
}

bool ImageStream::step() {
  bool waits = false;
  const auto decide = [&](Whole& frame) {
    FrameQueue::Decision decision = this->decide(frame);
    waits = std::holds_alternative<std::string>(decision);
    return decision;
  };
  while (queue_.poseFirst(stream_, decide)) {
  }
  return waits;
}

FrameQueue::Decision ImageStream::decide(Whole& frame) {
  const sensor_msgs::Image& image = *frame.messages.image;
  const ros::Time stamp = image.header.stamp;
  if (!frame.is_checked) {
    if (const auto rejection = check(frame.messages)) return *rejection;
    frame.is_checked = true;
    frame.may_be_ahead = handleTimeJump(stamp);
  }
  PoseAnswer pose{Eigen::Isometry3d::Identity()};
  if (!pose_frame_.empty()) {
    pose = transforms_.find(pose_frame_, cameraFrame(image), stamp, "the image");
  }
  const auto waited = waitingTime() - frame.since;
  if (pose.may_come && waited < toSteadyDuration(params_.tf_timeout_s)) return pose.text;
  transforms_.notePose(pose.T_W_C.has_value());
  if (pose.may_come) {
    return Rejection{
        DropReason::kNoTransform,
        pose.text + formatted("; waited %g s (input/tf_timeout_s)", params_.tf_timeout_s)};
  }
  if (!pose.T_W_C) return Rejection{DropReason::kBeforeTransforms, pose.text};
  if (is_motion_new_.exchange(false)) {
    motion_gate_ = MotionGate(params_.max_speed_m_s, params_.max_turn_deg_s);
  }
  if (const auto jump = motion_gate_.check(stamp.toSec(), *pose.T_W_C)) {
    return Rejection{DropReason::kPoseJump, *jump};
  }
  return makePosed(frame.messages, *pose.T_W_C);
}

/// Checks of a frame that has just become whole.
std::optional<Rejection> ImageStream::check(const CameraImage& frame) {
  if (auto rejection = kind_.check(*frame.image, *frame.info)) return rejection;
  if (frame.mask) {
    if (auto rejection = checkMask(*frame.mask, *frame.image)) return rejection;
  }
  if (cameraFrame(*frame.image).empty()) {
    return Rejection{DropReason::kNoTransform,
                     "the image has no frame_id; set it in the driver, or input/camera_frame"};
  }
  const ros::Time stamp = frame.image->header.stamp;
  if (std::exchange(last_whole_, stamp) == stamp) {
    return Rejection{DropReason::kRepeatedStamp, kRepeatedStampText};
  }
  if (rate_limit_.takes(stamp.toSec())) return std::nullopt;
  return Rejection{DropReason::kOverRate, "more than colour/max_rate_hz"};
}

std::string ImageStream::cameraFrame(const sensor_msgs::Image& image) const {
  const bool is_given = !kind_.is_colour && !params_.camera_frame.empty();
  return is_given ? params_.camera_frame : stripLeadingSlash(image.header.frame_id);
}

/// Whether the stamp is so far ahead of those before that it may be wrong.
bool ImageStream::handleTimeJump(const ros::Time& stamp) {
  endGap(stamp);
  if (!last_stamp_.isZero() && stamp.toSec() - last_stamp_.toSec() > kGap_s) {
    ahead_stamp_ = stamp;
    return true;
  }
  const ros::Time last = std::exchange(last_stamp_, stamp);
  if (last.isZero() || last.toSec() - stamp.toSec() < kTimeJump_s) {
    last_stamp_ = std::max(last, stamp);
    return false;
  }
  ROS_WARN_STREAM_NAMED("dtsdf_mapping", "the images' stamps went back from "
                                             << last << " to " << stamp
                                             << ": waiting frames and transforms are discarded, "
                                                "the map is kept (clear_map empties it)");
  on_time_jump_ ? on_time_jump_(stamp) : restartStamps(stamp);
  last_stamp_ = stamp;
  return false;
}

/// After a stamp far ahead: where the next one continues before it, that one was wrong, and nothing
/// else is.
void ImageStream::endGap(const ros::Time& stamp) {
  const ros::Time ahead = std::exchange(ahead_stamp_, ros::Time());
  if (ahead.isZero()) return;
  const double gap_s = ahead.toSec() - last_stamp_.toSec();
  const bool continues_there = stamp.toSec() > ahead.toSec() - kTimeJump_s;
  if (continues_there || stamp.toSec() < last_stamp_.toSec() - kTimeJump_s) {
    last_stamp_ = ahead;
    return;
  }
  queue_.dropStamp(
      stream_, ahead,
      {DropReason::kTimeJump,
       formatted("its stamp was %g s ahead of the images before it and of the next one", gap_s)});
}

void ImageStream::restartStamps(const ros::Time& stamp) {
  last_stamp_ = ahead_stamp_ = last_whole_ = ros::Time();
  queue_.restart(stream_, stamp);
}

FrameQueue::Decision ImageStream::makePosed(const CameraImage& messages,
                                            const Eigen::Isometry3d& T_W_C) {
  PosedFrame posed;
  posed.stamp = messages.image->header.stamp;
  posed.frame_id = cameraFrame(*messages.image);
  posed.camera = camera_;
  try {
    const auto image = messages.mask ? applyMask(*messages.mask, *messages.image) : messages.image;
    const CameraImage camera = rectification_.apply({image, messages.info});
    if (kind_.is_colour) {
      posed.image = makeColourFrame(camera.image, *camera.info, posed.pixels);
    } else {
      const DepthUnits units{params_.unit_16uc1_m, params_.unit_32fc1_m};
      DepthFrame depth = makeDepthFrame(camera.image, *camera.info, units, posed.pixels);
      if (params_.depth == DepthChoice::kRay) {
        const auto turned = boost::make_shared<cv_bridge::CvImage>();
        turned->image.create(depth.height, depth.width, CV_32FC1);
        turnToAxis(depth, turned->image.ptr<float>());
        posed.pixels = turned;
      }
      posed.image = depth;
    }
  } catch (const std::exception& error) {  // of OpenCV or cv_bridge, or no memory for a copy
    return Rejection{DropReason::kBadImage, errorText(error)};
  }
  std::visit([&](auto& image) { image.T_W_C = T_W_C; }, posed.image);
  noteDoubts(posed);
  return posed;
}

void ImageStream::noteDoubts(const PosedFrame& posed) {
  std::string text = rectification_.warning();  // which the log has
  const bool is_logged = !text.empty();
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
  if (std::exchange(warning_, text) != text && !text.empty() && !is_logged) {
    ROS_WARN_STREAM_NAMED("dtsdf_mapping", text);
  }
}

StreamReport ImageStream::report() const {
  StreamReport report = accounting_.counts();
  report.kind = kind_.is_colour ? "color" : "depth";
  report.topic = compressed_ ? compressed_.getTopic() : image_topic_;
  report.waiting_for = queue_.waitingFor(stream_);
  report.camera = name_;
  report.is_needed = is_needed_;
  report.info_topic = info_topic_;
  report.image_publishers =
      compressed_ ? compressed_.getNumPublishers() : by_transport_.getNumPublishers();
  const std::lock_guard<std::mutex> lock(mutex_);
  report.warning = warning_;
  return report;
}

}  // namespace dtsdf
