/// One kind of a camera's images: its topics, its frames on their way to the map, and what became
/// of them.
#pragma once

#include <ros/node_handle.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "dtsdf_mapping/io/rate_limit.h"
#include "ros/input/camera_input.h"
#include "ros/input/camera_report.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/frame_intake.h"

namespace dtsdf {

class ImageStream {
 public:
  /// What a stream works with; all of it outlives it.
  struct Parts {
    PoseSource& poses;
    FrameQueue& posed_frames;
    FrameQueue::Stream stream;  ///< Its own in there.
    size_t camera;              ///< Its place among the cameras.
    std::function<void()> on_frame;      ///< Something waits for the intake's thread.
    std::function<void()> on_time_jump;  ///< Stamps went back.
  };
  /// What makes a stream one of depth or of colour.
  struct Kind {
    const ImageTopics& topics;
    std::unique_ptr<ImageKind> images;
    double max_rate_hz = 0.0;  ///< Of what is taken of it; 0: all.
  };

  /// Of topics in `ns` (see CameraInput for why); `name` begins the warnings.
  ImageStream(const std::string& name, const std::string& ns, const ros::NodeHandle& nh,
              const InputParams& params, Kind kind, const Parts& parts);

  /// Begins and ends to receive; the latter waits for nobody.
  void subscribe(const ros::NodeHandle& private_nh);
  void unsubscribe() { input_.reset(); }

  /// Intake's thread: see FrameIntake::step().
  std::chrono::milliseconds step() noexcept { return intake_.step(); }

  /// Callbacks' thread: see FrameIntake::startAnew().
  void startAnew() { intake_.startAnew(); }

  /// Intake's thread: see FrameIntake::restartMotion().
  void restartMotion() { intake_.restartMotion(); }

  void setPaused(bool paused) { intake_.setPaused(paused); }
  bool paused() const { return intake_.paused(); }

  /// While subscribed.
  StreamReport report() const;

 private:
  void onFrame(const FrameMessages& frame);
  void makeRoom();

  std::string ns_;
  ros::NodeHandle nh_;
  InputParams params_;
  Kind kind_;
  std::function<void()> on_frame_;
  RateLimit rate_limit_;  ///< Callbacks' thread only.
  FrameAccounting accounting_;
  FrameIntake intake_;
  std::unique_ptr<CameraInput> input_;
};

}  // namespace dtsdf
