/// The bounded queue in which frames wait for their transform and their turn.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <Eigen/Geometry>
#include <chrono>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "params/node_params.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/motion_gate.h"
#include "ros/input/pose_source.h"

namespace dtsdf {

struct PosedFrame {
  sensor_msgs::ImageConstPtr image;
  sensor_msgs::CameraInfoConstPtr info;
  Eigen::Isometry3d T_W_C;
};

/// Frames come in on the callbacks' thread and go out, each with its true pose, on the worker's.
class FrameIntake {
 public:
  FrameIntake(const InputParams& params, PoseSource& poses, FrameAccounting& accounting);

  /// Takes a frame that passes the checks; the oldest is dropped when the queue is full.
  void push(const sensor_msgs::ImageConstPtr& image, const sensor_msgs::CameraInfoConstPtr& info);

  /// The next frame whose pose is known; drops those whose pose will not come. Does not wait.
  std::optional<PosedFrame> next();

  /// While paused, frames are dropped, those that wait included.
  void setPaused(bool paused);
  bool paused() const;
  size_t size() const;

  /// What the first frame in the queue waits for; empty if it does not wait.
  std::string waitingFor() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct WaitingFrame {
    sensor_msgs::ImageConstPtr image;
    sensor_msgs::CameraInfoConstPtr info;
    Clock::time_point arrival;
  };

  std::string cameraFrame(const sensor_msgs::Image& image) const;
  std::optional<Rejection> check(const sensor_msgs::Image& image,
                                 const sensor_msgs::CameraInfo& info) const;
  void handleTimeJump(const ros::Time& stamp);
  void dropAll(DropReason reason, const std::string& text);
  bool timedOut(const WaitingFrame& frame) const;
  std::optional<WaitingFrame> front() const;
  bool popFront(const WaitingFrame& frame);
  std::optional<Rejection> judge(const WaitingFrame& frame, const PoseAnswer& pose);

  InputParams params_;
  PoseSource& poses_;
  FrameAccounting& accounting_;
  MotionGate motion_gate_;  ///< Worker's thread only.
  ros::Time last_stamp_;    ///< Callbacks' thread only.

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::deque<WaitingFrame> queue_;
  bool paused_ = false;
  std::string waiting_for_;
};

}  // namespace dtsdf
