#include "ros/input/image_stream.h"

#include <image_transport/camera_common.h>
#include <ros/console.h>

#include <algorithm>
#include <exception>
#include <utility>
#include <vector>

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
  FrameQueue::StreamOptions options;
  options.name = name;
  options.is_colour = kind.rectified_as == Rectification::Kind::kColour;
  options.any_info = params.camera_info == CameraInfoChoice::kLatest;
  options.wants_mask = params.mask;
  options.no_info_text = std::string("no camera_info") +
                         (options.any_info ? "" : " with the same stamp") + " on '" + info_topic +
                         "'";
  options.no_mask_text = "no mask with the same stamp on '" + mask_topic + "'";
  return options;
}

std::string accountingName(const ImageKind& kind, const std::string& name) {
  if (kind.rectified_as == Rectification::Kind::kDepth) return name;
  return name.empty() ? "colour" : name + ", colour";
}

}  // namespace

ImageStream::ImageStream(ImageKind kind, const std::string& name, const std::string& ns,
                         const ros::NodeHandle& nh, const InputParams& params, Parts parts)
    : kind_(std::move(kind)),
      params_(params),
      parts_(std::move(parts)),
      nh_(nh),
      ns_(ns),
      image_topic_(nh.resolveName(ns + "/" + kind_.image_topic)),
      info_topic_(
          infoTopicFor(nh, nh.resolveName(ns + "/" + kind_.info_topic, false), image_topic_)),
      accounting_(accountingName(kind_, name)),
      stream_(parts_.queue.addStream(
          queueOptions(kind_, name, params, info_topic_, nh.resolveName(ns + "/mask/image")),
          accounting_)),
      rate_limit_(kind_.max_rate_hz),
      motion_gate_(params.max_speed_m_s, params.max_turn_deg_s),
      rectification_(params.rectify, image_topic_, kind_.rectified_as),
      transport_(nh) {}

void ImageStream::subscribe(const ros::NodeHandle& private_nh) {
  info_ = nh_.subscribe(info_topic_, kSubscriberQueue, &ImageStream::onInfo, this);
  if (params_.mask) {
    mask_ = nh_.subscribe(ns_ + "/mask/image", kSubscriberQueue, &ImageStream::onMask, this);
  }
  const image_transport::TransportHints hints("raw", ros::TransportHints(), private_nh,
                                              kind_.transport_param);
  const std::string topic = ns_ + "/" + kind_.image_topic;
  if (!decodesItself(hints.getTransport())) {
    by_transport_ =
        transport_.subscribe(topic, kSubscriberQueue, &ImageStream::onImage, this, hints);
    return;
  }
  ROS_INFO_STREAM_NAMED("dtsdf_mapping", "image_transport has no plugin for "
                                             << kind_.own_transport << ": decoded by this node");
  compressed_ = nh_.subscribe(image_topic_ + "/" + kind_.own_transport, kSubscriberQueue,
                              &ImageStream::onCompressed, this);
}

bool ImageStream::decodesItself(const std::string& transport) const {
  if (transport != kind_.own_transport) return false;
  const std::vector<std::string> plugins = transport_.getLoadableTransports();
  return std::find(plugins.begin(), plugins.end(), "image_transport/" + transport) == plugins.end();
}

void ImageStream::onCompressed(const sensor_msgs::CompressedImageConstPtr& message) {
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

void ImageStream::onImage(const sensor_msgs::ImageConstPtr& image) {
  guarded("image", [&] {
    const ros::Time stamp = image->header.stamp;
    accounting_.imageReceived(stamp);
    if (const auto rejection = checkArrival(*image, parts_.queue.maxBytes())) {
      return accounting_.dropped(*rejection, stamp);
    }
    parts_.queue.addImage(stream_, image);
  });
}

void ImageStream::onInfo(const sensor_msgs::CameraInfoConstPtr& info) {
  guarded("camera_info", [&] {
    accounting_.cameraInfoReceived();
    const std::string problem = findProblem(*info);
    if (problem.empty()) return parts_.queue.addInfo(stream_, info);
    ROS_WARN_STREAM_THROTTLE_NAMED(
        5.0, "dtsdf_mapping", "camera_info on '" << info_topic_ << "' is ignored: " << problem);
  });
}

void ImageStream::onMask(const sensor_msgs::ImageConstPtr& mask) {
  guarded("mask", [&] {
    const auto rejection = checkArrival(*mask, parts_.queue.maxBytes());
    if (!rejection) return parts_.queue.addMask(stream_, mask);
    ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping", "a mask is ignored: " << rejection->text);
  });
}

bool ImageStream::step() {
  while (poseFirst()) {
  }
  return parts_.queue.firstWhole(stream_).has_value();
}

/// False if there is no frame, or the first one has to wait.
bool ImageStream::poseFirst() {
  const std::optional<Whole> frame = parts_.queue.firstWhole(stream_);
  if (!frame) return false;
  if (!frame->is_checked && !admit(*frame)) return true;
  const ros::Time stamp = frame->messages.image->header.stamp;
  PoseAnswer pose;
  pose.kind = PoseAnswer::Kind::kKnown;
  if (!parts_.pose_frame.empty()) {
    pose = parts_.transforms.find(parts_.pose_frame, cameraFrame(*frame->messages.image), stamp,
                                  "the image");
  }
  const bool may_come = pose.kind == PoseAnswer::Kind::kNotYet;
  if (may_come &&
      std::chrono::steady_clock::now() - frame->since < toSteadyDuration(params_.tf_timeout_s)) {
    parts_.queue.noteWaiting(stream_, pose.text);
    return false;
  }
  parts_.transforms.notePose(pose.kind == PoseAnswer::Kind::kKnown);
  if (const auto rejection = judge(*frame, pose)) {
    parts_.queue.drop(stream_, *frame, *rejection);
  } else {
    setPosed(*frame, pose);
  }
  return true;
}

/// Checks of a frame that has just become whole. @return whether it is still there.
bool ImageStream::admit(const Whole& frame) {
  const ros::Time stamp = frame.messages.image->header.stamp;
  std::optional<Rejection> rejection = check(frame.messages);
  if (!rejection && std::exchange(last_whole_, stamp) == stamp) {
    rejection = Rejection{DropReason::kRepeatedStamp,
                          "the image before has the same stamp, so one of them has a wrong pose"};
  }
  if (!rejection && !rate_limit_.takes(stamp.toSec())) {
    rejection = Rejection{DropReason::kOverRate, "more than colour/max_rate_hz"};
  }
  if (rejection) {
    parts_.queue.drop(stream_, frame, *rejection);
    return false;
  }
  parts_.queue.setChecked(stream_, frame, handleTimeJump(stamp));
  return true;
}

std::optional<Rejection> ImageStream::check(const FrameMessages& frame) const {
  if (auto rejection = kind_.check(*frame.image, *frame.info)) return rejection;
  if (frame.mask) {
    if (auto rejection = checkMask(*frame.mask, *frame.image)) return rejection;
  }
  if (!cameraFrame(*frame.image).empty()) return std::nullopt;
  return Rejection{DropReason::kNoTransform,
                   "the image has no frame_id; set it in the driver, or input/camera_frame"};
}

std::string ImageStream::cameraFrame(const sensor_msgs::Image& image) const {
  return params_.camera_frame.empty() ? stripLeadingSlash(image.header.frame_id)
                                      : params_.camera_frame;
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
  parts_.on_time_jump ? parts_.on_time_jump(stamp) : restartStamps(stamp);
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
  parts_.queue.dropStamp(
      stream_, ahead,
      {DropReason::kTimeJump,
       formatted("its stamp was %g s ahead of the images before it and of the next one", gap_s)});
}

void ImageStream::restartStamps(const ros::Time& stamp) {
  last_stamp_ = ahead_stamp_ = last_whole_ = ros::Time();
  parts_.queue.restart(stream_, stamp);
}

std::optional<Rejection> ImageStream::judge(const Whole& frame, const PoseAnswer& pose) {
  if (pose.kind == PoseAnswer::Kind::kNever) {
    return Rejection{DropReason::kBeforeTransforms, pose.text};
  }
  if (pose.kind == PoseAnswer::Kind::kNotYet) {
    return Rejection{
        DropReason::kNoTransform,
        pose.text + formatted("; waited %g s (input/tf_timeout_s)", params_.tf_timeout_s)};
  }
  if (is_motion_new_.exchange(false)) {
    motion_gate_ = MotionGate(params_.max_speed_m_s, params_.max_turn_deg_s);
  }
  const double stamp_s = frame.messages.image->header.stamp.toSec();
  if (const auto jump = motion_gate_.check(stamp_s, pose.T_W_C)) {
    return Rejection{DropReason::kPoseJump, *jump};
  }
  return std::nullopt;
}

void ImageStream::setPosed(const Whole& frame, const PoseAnswer& pose) {
  const FrameMessages& messages = frame.messages;
  PosedFrame posed;
  posed.stamp = messages.image->header.stamp;
  posed.frame_id = cameraFrame(*messages.image);
  posed.camera = parts_.camera;
  try {
    const auto image = messages.mask ? applyMask(*messages.mask, *messages.image) : messages.image;
    kind_.fill(rectification_.apply({image, messages.info}), posed);
  } catch (const std::exception& error) {  // of OpenCV or cv_bridge, or no memory for a copy
    return parts_.queue.drop(stream_, frame, {DropReason::kBadImage, errorText(error)});
  }
  std::visit([&](auto& image) { image.T_W_C = pose.T_W_C; }, posed.image);
  noteDoubts(posed);
  parts_.queue.setPosed(stream_, frame, std::move(posed));
}

void ImageStream::noteDoubts(const PosedFrame& posed) {
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

StreamReport ImageStream::report() const {
  StreamReport report;
  report.frames = accounting_.counts();
  report.image_topic = compressed_ ? compressed_.getTopic() : by_transport_.getTopic();
  if (report.image_topic.empty()) report.image_topic = image_topic_;
  report.info_topic = info_topic_;
  report.image_publishers =
      compressed_ ? compressed_.getNumPublishers() : by_transport_.getNumPublishers();
  report.waiting = report.frames.waiting();
  report.waiting_for = parts_.queue.waitingFor(stream_);
  const std::lock_guard<std::mutex> lock(mutex_);
  report.warning = warning_;
  return report;
}

}  // namespace dtsdf
