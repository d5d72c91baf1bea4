/// One camera: its topics, its frames on their way to the map, and what became of them.
#pragma once

#include <ros/node_handle.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "ros/input/camera_input.h"
#include "ros/input/camera_report.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/frame_intake.h"

namespace dtsdf {

class Camera {
 public:
  /// What a camera works with; all of it outlives it.
  struct Parts {
    PoseSource& poses;
    FrameQueue& posed_frames;
    std::function<void()> on_frame;      ///< Something waits for the intake's thread.
    std::function<void()> on_time_jump;  ///< Stamps went back: all cameras are to start anew.
  };

  /// Of topics in `ns`, for whose sake see CameraInput; `name` is empty for the only camera.
  Camera(std::string name, std::string ns, const ros::NodeHandle& nh, const InputParams& params,
         const Parts& parts);

  /// Begins and ends to receive; the latter waits for nobody.
  void subscribe(const ros::NodeHandle& private_nh);
  void unsubscribe() { input_.reset(); }

  /// Intake's thread: see FrameIntake::step().
  std::chrono::milliseconds step() noexcept { return intake_.step(); }

  /// Callbacks' thread: see FrameIntake::startAnew().
  void startAnew() { intake_.startAnew(); }

  void setPaused(bool paused) { intake_.setPaused(paused); }
  bool paused() const { return intake_.paused(); }

  /// While subscribed.
  CameraReport report() const;

 private:
  std::string name_, ns_;
  ros::NodeHandle nh_;
  InputParams params_;
  std::function<void()> on_frame_;
  FrameAccounting accounting_;
  FrameIntake intake_;
  std::unique_ptr<CameraInput> input_;
};

}  // namespace dtsdf
