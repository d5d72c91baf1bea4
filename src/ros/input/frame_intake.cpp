#include "ros/input/frame_intake.h"

#include <ros/console.h>

#include <exception>
#include <utility>

#include "params/printable.h"
#include "params/text.h"
#include "ros/common/callback_guard.h"
#include "ros/input/images.h"

namespace dtsdf {
namespace {

using std::chrono::milliseconds;

/// A stamp further ahead of the last may be wrong, or come after a gap: the next one shows which.
constexpr double kGap_s = 30.0;
/// So many frames keep the map busy until more come.
constexpr size_t kBusy = 3;
/// How often a waiting frame asks for its transform.
constexpr milliseconds kTransformPoll{5};
/// Until the next image, which wakes the thread.
constexpr milliseconds kUntilNextImage{1000};

}  // namespace

FrameIntake::FrameIntake(const InputParams& params, const Parts& parts, ImageKind kind,
                         const std::string& image_topic, SteadyClock clock)
    : params_(params),
      parts_(parts),
      kind_(std::move(kind)),
      accounting_(parts_.ledger.of(parts_.stream)),
      clock_(std::move(clock)),
      motion_gate_(params.max_speed_m_s, params.max_turn_deg_s),
      rectification_(params.rectify, image_topic, kind_.rectified_as) {}

void FrameIntake::push(const FrameMessages& frame) {
  const ros::Time stamp = frame.image->header.stamp;
  if (paused()) return dropPaused(stamp);
  if (const auto rejection = check(frame)) {
    return accounting_.dropped(rejection->reason, stamp, rejection->text);
  }
  const bool may_be_ahead = handleTimeJump(stamp);
  const auto image = frame.mask ? applyMask(*frame.mask, *frame.image) : frame.image;
  if (!enqueue({image, frame.info, clock_(), may_be_ahead})) {
    return dropPaused(stamp);  // paused meanwhile
  }
  while (isFull()) {
    if (!makeRoom()) return;
  }
  if (shortensQueue()) makeRoom();
}

bool FrameIntake::isFull() const {
  return size() > static_cast<size_t>(params_.queue_size) || waitingBytes() > queueBytesOf(params_);
}

/// Looked at each time the map has taken half as many as there is room for. After a stall, as while
/// a map is saved, there are more than before once, and then fewer: a fast map works them off.
bool FrameIntake::shortensQueue() {
  const FrameQueue& posed = parts_.posed_frames;
  const Backlog now = {posed.backlogOf(parts_.stream), posed.takenOf(parts_.stream)};
  if (now.waiting == 0) is_overloaded_ = false;
  const bool is_short = now.waiting <= kBusy;
  if (is_short ||
      2 * (now.taken - seen_backlog_.taken) >= static_cast<size_t>(params_.queue_size)) {
    behind_ = is_short || now.waiting < seen_backlog_.waiting ? 0 : behind_ + 1;
    seen_backlog_ = now;
  }
  if (behind_ >= 2) is_overloaded_ = true;
  return is_overloaded_ && !is_short;
}

void FrameIntake::dropPaused(const ros::Time& stamp) {
  accounting_.dropped(DropReason::kPaused, stamp, "mapping is paused");
}

bool FrameIntake::enqueue(WaitingFrame frame) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (paused_) return false;
  queue_.push_back(std::move(frame));
  return true;
}

bool FrameIntake::makeRoom() {
  std::string waited_for;
  ros::Time stamp;
  if (const std::optional<PosedFrame> posed = parts_.posed_frames.pushOut(parts_.stream)) {
    stamp = posed->stamp;
  } else {
    waited_for = waitingFor();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (queue_.empty()) return false;  // the map has taken some meanwhile
    stamp = queue_.front().image->header.stamp;
    queue_.pop_front();
  }
  accounting_.dropped(DropReason::kQueueFull, stamp,
                      waited_for.empty()
                          ? "the queue is full: fusing takes longer than the time between images"
                          : "the queue is full: the oldest image still waits for its transform (" +
                                waited_for + ")");
  if (!parts_.posed_frames.isNeeded(parts_.stream) ||
      parts_.posed_frames.holdsBefore(parts_.stream, stamp)) {
    return true;
  }
  while (const std::optional<PosedFrame> extra = parts_.posed_frames.takeExtraBefore(stamp)) {
    parts_.ledger.of(extra->stream)
        .dropped(DropReason::kQueueFull, extra->stamp,
                 "the queue is full, and the next depth image was dropped");
  }
  return true;
}

std::optional<Rejection> FrameIntake::check(const FrameMessages& frame) const {
  if (auto rejection = kind_.check(*frame.image, *frame.info)) return rejection;
  if (frame.mask) {
    if (auto rejection = checkMask(*frame.mask, *frame.image)) return rejection;
  }
  if (!cameraFrame(*frame.image).empty()) return std::nullopt;
  return Rejection{DropReason::kNoTransform,
                   "the image has no frame_id; set it in the driver, or input/camera_frame"};
}

std::string FrameIntake::cameraFrame(const sensor_msgs::Image& image) const {
  return params_.camera_frame.empty() ? stripLeadingSlash(image.header.frame_id)
                                      : params_.camera_frame;
}

bool FrameIntake::handleTimeJump(const ros::Time& stamp) {
  goOnAfterGap(stamp);
  if (!last_stamp_.isZero() && stamp.toSec() - last_stamp_.toSec() > kGap_s) {
    ahead_stamp_ = stamp;
    return true;
  }
  const ros::Time last = std::exchange(last_stamp_, stamp);
  if (last.isZero() || last.toSec() - stamp.toSec() < kTimeJump_s) {
    if (last > stamp) last_stamp_ = last;
    return false;
  }
  ROS_WARN_STREAM_NAMED("dtsdf_mapping", "the images' stamps went back from "
                                             << last << " to " << stamp
                                             << ": waiting frames and transforms are discarded, "
                                                "the map is kept (clear_map empties it)");
  if (parts_.on_time_jump) {
    parts_.on_time_jump();
  } else {
    restartStamps();
  }
  last_stamp_ = stamp;
  return false;
}

/// After a stamp far ahead: where the next one goes on before it, that one was wrong, and nothing
/// else is.
void FrameIntake::goOnAfterGap(const ros::Time& stamp) {
  const ros::Time ahead = std::exchange(ahead_stamp_, ros::Time());
  if (ahead.isZero()) return;
  const double gap_s = ahead.toSec() - last_stamp_.toSec();
  const bool goes_on_there = stamp.toSec() > ahead.toSec() - kTimeJump_s;
  if (goes_on_there || stamp.toSec() < last_stamp_.toSec() - kTimeJump_s) {
    last_stamp_ = ahead;
    return;
  }
  dropNewest(
      ahead, DropReason::kTimeJump,
      formatted("its stamp was %g s ahead of the images before it and of the next one", gap_s));
}

bool FrameIntake::dropNewest(const ros::Time& stamp, DropReason reason, const std::string& text) {
  const std::lock_guard<std::mutex> passing(passing_);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (queue_.empty() || queue_.back().image->header.stamp != stamp) return false;
    if (queue_.size() == 1) waiting_for_.clear();
    queue_.pop_back();
  }
  accounting_.dropped(reason, stamp, text);
  return true;
}

void FrameIntake::restartStamps() {
  last_stamp_ = ahead_stamp_ = ros::Time();
  dropAll(DropReason::kTimeJump, "stamps went back while it waited");
}

milliseconds FrameIntake::step() noexcept {
  guarded("intake of frames", [this] {
    while (passOnFirst()) {
    }
  });
  return front() ? kTransformPoll : kUntilNextImage;
}

/// False if there is no frame, or the first one has to wait.
bool FrameIntake::passOnFirst() {
  const std::optional<WaitingFrame> frame = front();
  if (!frame) return false;
  const PoseAnswer pose =
      parts_.poses.lookUp(cameraFrame(*frame->image), frame->image->header.stamp);
  if (pose.kind == PoseAnswer::Kind::kNotYet && !timedOut(*frame)) {
    const std::lock_guard<std::mutex> lock(mutex_);
    waiting_for_ = pose.text;
    return false;
  }
  const std::lock_guard<std::mutex> lock(passing_);
  if (popFront(*frame)) passOn(*frame, pose);  // else it was pushed out meanwhile
  return true;
}

void FrameIntake::passOn(const WaitingFrame& frame, const PoseAnswer& pose) {
  PosedFrame posed;
  posed.stamp = frame.image->header.stamp;
  std::optional<Rejection> rejection = judge(frame, pose);
  try {
    if (!rejection) kind_.fill(rectification_.applyAndWarn({frame.image, frame.info}), posed);
  } catch (const std::exception& error) {  // of OpenCV or cv_bridge, or no memory for a copy
    rejection = Rejection{DropReason::kBadImage, errorText(error)};
  }
  if (rejection) {
    accounting_.dropped(rejection->reason, posed.stamp, rejection->text);
    if (frame.may_be_ahead) return;
    return parts_.posed_frames.settle(parts_.stream, posed.stamp);
  }
  std::visit([&](auto& image) { image.T_W_C = pose.T_W_C; }, posed.image);
  posed.stream = parts_.stream;
  posed.frame_id = cameraFrame(*frame.image);
  posed.camera = parts_.camera;
  if (const auto* depth = std::get_if<DepthFrame>(&posed.image)) checkOpticalFrame(frame, *depth);
  const ros::Time stamp = posed.stamp;
  if (parts_.posed_frames.push(parts_.stream, stamp, std::move(posed))) return;
  accounting_.dropped(DropReason::kOutOfOrder, stamp,
                      "a later frame of another camera has already been fused; raise "
                      "input/merge_wait_s above this camera's delay");
}

void FrameIntake::checkOpticalFrame(const WaitingFrame& frame, const DepthFrame& depth) {
  if (optical_frame_check_.isBodyFrame()) return;  // is reported already
  optical_frame_check_.add(depth);
  if (!optical_frame_check_.isBodyFrame()) return;
  const std::string text =
      "'" + printable(cameraFrame(*frame.image)) +
      "' is not an optical frame: its x axis seems to point forward, but z must; set the optical "
      "frame in the driver or in input/camera_frame, then call clear_map";
  ROS_WARN_STREAM_NAMED("dtsdf_mapping", text);
  const std::lock_guard<std::mutex> lock(mutex_);
  warning_ = text;
}

std::optional<Rejection> FrameIntake::judge(const WaitingFrame& frame, const PoseAnswer& pose) {
  if (pose.kind == PoseAnswer::Kind::kNever) {
    return Rejection{DropReason::kBeforeTransforms, pose.text};
  }
  if (pose.kind == PoseAnswer::Kind::kNotYet) {
    return Rejection{
        DropReason::kNoTransform,
        pose.text + formatted("; waited %g s (input/tf_timeout_s)", params_.tf_timeout_s)};
  }
  if (const auto jump = motion_gate_.check(frame.image->header.stamp.toSec(), pose.T_W_C)) {
    return Rejection{DropReason::kPoseJump, *jump};
  }
  return std::nullopt;
}

bool FrameIntake::timedOut(const WaitingFrame& frame) const {
  return clock_() - frame.arrival >= toSteadyDuration(params_.tf_timeout_s);
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
  std::deque<WaitingFrame> waiting;
  const std::lock_guard<std::mutex> passing(passing_);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    waiting.swap(queue_);
    waiting_for_.clear();
  }
  for (const PosedFrame& frame : parts_.posed_frames.takeAllOf(parts_.stream)) {
    accounting_.dropped(reason, frame.stamp, text);
  }
  for (const WaitingFrame& frame : waiting) {
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
  return queue_.size() + parts_.posed_frames.sizeOf(parts_.stream);
}

size_t FrameIntake::waitingBytes() const {
  size_t bytes = parts_.posed_frames.sumOf(parts_.stream,
                                           [](const PosedFrame& frame) { return bytesOf(frame); });
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const WaitingFrame& frame : queue_) bytes += frame.image->data.size();
  return bytes;
}

std::string FrameIntake::waitingFor() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return waiting_for_;
}

std::string FrameIntake::warning() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return warning_;
}

}  // namespace dtsdf
