#include "ros/input/frame_intake.h"

#include <ros/console.h>

#include <utility>

#include "params/frame_name.h"
#include "ros/input/depth_image.h"

namespace dtsdf {
namespace {

/// Stamps that go back by more than this mean a new recording or a loop of it; less is disorder.
constexpr double kTimeJump_s = 0.5;

}  // namespace

FrameIntake::FrameIntake(const InputParams& params, PoseSource& poses, FrameAccounting& accounting)
    : params_(params),
      poses_(poses),
      accounting_(accounting),
      motion_gate_(params.max_speed_m_s, params.max_turn_deg_s) {}

void FrameIntake::push(const sensor_msgs::ImageConstPtr& image,
                       const sensor_msgs::CameraInfoConstPtr& info) {
  const ros::Time stamp = image->header.stamp;
  if (paused()) return accounting_.dropped(DropReason::kPaused, stamp, "mapping is paused");
  if (const auto rejection = check(*image, *info)) {
    return accounting_.dropped(rejection->reason, stamp, rejection->text);
  }
  handleTimeJump(stamp);

  std::optional<WaitingFrame> oldest;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    queue_.push_back({image, info, Clock::now()});
    if (queue_.size() > static_cast<size_t>(params_.queue_size)) {
      oldest = std::move(queue_.front());
      queue_.pop_front();
    }
  }
  if (oldest) {
    const std::string waited_for = waitingFor();
    accounting_.dropped(DropReason::kQueueFull, oldest->image->header.stamp,
                        "frames come faster than they can be fused, or wait too long (" +
                            (waited_for.empty() ? "every transform is there" : waited_for) + ")");
  }
}

std::optional<Rejection> FrameIntake::check(const sensor_msgs::Image& image,
                                            const sensor_msgs::CameraInfo& info) const {
  if (auto rejection = checkDepthImage(image, info)) return rejection;
  if (!cameraFrame(image).empty()) return std::nullopt;
  return Rejection{DropReason::kNoTransform,
                   "the image has no frame_id; set it in the driver, or input/camera_frame"};
}

std::string FrameIntake::cameraFrame(const sensor_msgs::Image& image) const {
  return params_.camera_frame.empty() ? stripLeadingSlash(image.header.frame_id)
                                      : params_.camera_frame;
}

void FrameIntake::handleTimeJump(const ros::Time& stamp) {
  const ros::Time last = std::exchange(last_stamp_, stamp);
  if (last.isZero() || last.toSec() - stamp.toSec() < kTimeJump_s) {
    if (last > stamp) last_stamp_ = last;
    return;
  }
  ROS_WARN_STREAM_NAMED("dtsdf_mapping", "the images' stamps went back from "
                                             << last << " to " << stamp
                                             << ": waiting frames and transforms are forgotten, "
                                                "the map is kept (clear_map empties it)");
  dropAll(DropReason::kTimeJump, "stamps went back while it waited");
  // Under simulated time the listener has done so itself, and new transforms may be in by now.
  if (!ros::Time::isSimTime()) poses_.clear();
}

std::optional<PosedFrame> FrameIntake::next() {
  while (const std::optional<WaitingFrame> frame = front()) {
    const ros::Time stamp = frame->image->header.stamp;
    const PoseAnswer pose = poses_.lookUp(cameraFrame(*frame->image), stamp);
    if (pose.kind == PoseAnswer::Kind::kNotYet && !timedOut(*frame)) {
      const std::lock_guard<std::mutex> lock(mutex_);
      waiting_for_ = pose.text;
      return std::nullopt;
    }
    if (!popFront(*frame)) continue;  // was pushed out meanwhile
    if (const auto rejection = judge(*frame, pose)) {
      accounting_.dropped(rejection->reason, stamp, rejection->text);
      continue;
    }
    return PosedFrame{frame->image, frame->info, pose.T_W_C};
  }
  return std::nullopt;
}

std::optional<Rejection> FrameIntake::judge(const WaitingFrame& frame, const PoseAnswer& pose) {
  if (pose.kind == PoseAnswer::Kind::kNever) {
    return Rejection{DropReason::kBeforeTransforms, pose.text};
  }
  if (pose.kind == PoseAnswer::Kind::kNotYet) {
    return Rejection{DropReason::kNoTransform,
                     pose.text + "; waited " + std::to_string(params_.tf_timeout_s) +
                         " s (input/tf_timeout_s)"};
  }
  if (const auto jump = motion_gate_.check(frame.image->header.stamp.toSec(), pose.T_W_C)) {
    return Rejection{DropReason::kPoseJump, *jump};
  }
  return std::nullopt;
}

bool FrameIntake::timedOut(const WaitingFrame& frame) const {
  return Clock::now() - frame.arrival >= std::chrono::duration<double>(params_.tf_timeout_s);
}

std::optional<FrameIntake::WaitingFrame> FrameIntake::front() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (queue_.empty()) return std::nullopt;
  return queue_.front();
}

bool FrameIntake::popFront(const WaitingFrame& frame) {
  const std::lock_guard<std::mutex> lock(mutex_);
  waiting_for_.clear();
  if (queue_.empty() || queue_.front().image != frame.image) return false;
  queue_.pop_front();
  return true;
}

void FrameIntake::dropAll(DropReason reason, const std::string& text) {
  std::deque<WaitingFrame> dropped;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    dropped.swap(queue_);
    waiting_for_.clear();
  }
  for (const WaitingFrame& frame : dropped) {
    accounting_.dropped(reason, frame.image->header.stamp, text);
  }
}

void FrameIntake::setPaused(bool paused) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    paused_ = paused;
  }
  if (paused) dropAll(DropReason::kPaused, "mapping was paused while it waited");
}

bool FrameIntake::paused() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return paused_;
}

size_t FrameIntake::size() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return queue_.size();
}

std::string FrameIntake::waitingFor() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return waiting_for_;
}

}  // namespace dtsdf
