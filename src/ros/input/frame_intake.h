/// Where frames wait for their transform, and in which order they go on to the map.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <chrono>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "params/node_params.h"
#include "ros/common/schedule.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/frame_assembly.h"
#include "ros/input/frame_queue.h"
#include "ros/input/image_kind.h"
#include "ros/input/pose_checks.h"
#include "ros/input/pose_source.h"
#include "ros/input/rectification.h"

namespace dtsdf {

/// The frames of one stream, a camera's depth or its colour, come in on the callbacks' thread; on
/// the intake's thread each gets its true pose and goes on to the map's queue. What one stream has
/// in both queues is bounded.
class FrameIntake {
 public:
  /// What the intake works with; all of it outlives it.
  struct Parts {
    PoseSource& poses;
    FrameQueue& posed_frames;
    FrameLedger& ledger;
    FrameQueue::Stream stream;  ///< Its number in both.
    size_t camera = 0;          ///< Its place among the cameras.
    /// Called where stamps go back: who depends on them is to restart, this intake included. None:
    /// it restarts alone.
    std::function<void()> on_time_jump{};
  };

  /// @param image_topic Its name shows whether images are raw.
  FrameIntake(const InputParams& params, const Parts& parts, ImageKind kind,
              const std::string& image_topic, SteadyClock clock = std::chrono::steady_clock::now);

  /// Callbacks' thread: takes a frame that passes the checks; the oldest is dropped where there is
  /// no room. A queue that does not get shorter while the map takes as many as there is room for is
  /// shortened, one frame for each that comes, so that what the map shows is new.
  void push(const FrameMessages& frame);

  /// Intake's thread: passes on the frames whose pose is known and drops those whose pose will not
  /// come. Returns how long there will be nothing to do.
  std::chrono::milliseconds step() noexcept;

  /// While paused, frames are dropped, those that wait included: once this has returned, none is
  /// passed on any more.
  void setPaused(bool paused);
  bool paused() const;

  /// Callbacks' thread: forgets the frames that wait, as stamps begin again.
  void restartStamps();

  /// Intake's thread: the next pose may be anywhere, as after a map was loaded.
  void restartMotion() { motion_gate_ = MotionGate(params_.max_speed_m_s, params_.max_turn_deg_s); }

  /// Callbacks' thread: drops a frame, as there is no room for all: the one that has waited
  /// longest, or, with several cameras, the one behind it (MergeQueue::pushOut()). False if none
  /// waits.
  bool makeRoom();

  /// Frames that wait for their transform or their turn, and what their images take.
  size_t size() const;
  size_t waitingBytes() const;

  /// What the first frame in the queue waits for; empty if it does not wait.
  std::string waitingFor() const;

  /// What is wrong with all the frames although they are fused; empty if nothing is known to be.
  std::string warning() const;

 private:
  struct WaitingFrame {
    sensor_msgs::ImageConstPtr image;
    sensor_msgs::CameraInfoConstPtr info;
    SteadyTime arrival;
    bool may_be_ahead = false;  ///< Its stamp may be wrong, so that it says nothing of the others.
  };

  std::string cameraFrame(const sensor_msgs::Image& image) const;
  std::optional<Rejection> check(const FrameMessages& frame) const;
  /// Whether the stamp is so far ahead of those before that it may be wrong.
  bool handleTimeJump(const ros::Time& stamp);
  void goOnAfterGap(const ros::Time& stamp);
  void dropPaused(const ros::Time& stamp);
  /// False while paused.
  bool enqueue(WaitingFrame frame);
  /// The frame that came last, if it has that stamp and waits for its transform still.
  bool dropNewest(const ros::Time& stamp, DropReason reason, const std::string& text);
  void dropAll(DropReason reason, const std::string& text);

  /// How many frames waited for the map once it had taken so many.
  struct Backlog {
    size_t waiting = 0, taken = 0;
  };

  bool isFull() const;
  bool shortensQueue();
  bool passOnFirst();
  void passOn(const WaitingFrame& frame, const PoseAnswer& pose);
  bool timedOut(const WaitingFrame& frame) const;
  std::optional<WaitingFrame> front() const;
  bool popFront(const WaitingFrame& frame);
  void checkOpticalFrame(const WaitingFrame& frame, const DepthFrame& depth);
  std::optional<Rejection> judge(const WaitingFrame& frame, const PoseAnswer& pose);

  InputParams params_;
  Parts parts_;
  const ImageKind kind_;
  FrameAccounting& accounting_;
  SteadyClock clock_;
  MotionGate motion_gate_;                 ///< Intake's thread only.
  Rectification rectification_;            ///< Intake's thread only.
  OpticalFrameCheck optical_frame_check_;  ///< Intake's thread only.
  ros::Time last_stamp_;                   ///< Callbacks' thread only.
  ros::Time ahead_stamp_;  ///< The same: of the last image, if far ahead of that; 0: it is not.
  Backlog seen_backlog_;   ///< Callbacks' thread only.
  int behind_ = 0;         ///< The same: so often in a row the backlog had not shrunk.
  bool is_overloaded_ = false;  ///< The same: until none waits.

  /// Held while a frame goes from one queue to the other, where dropAll() would miss it. Before
  /// mutex_, if both are.
  std::mutex passing_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  std::deque<WaitingFrame> queue_;
  bool paused_ = false;
  std::string waiting_for_;
  std::string warning_;
};

}  // namespace dtsdf
