/// One camera: its depth, and its colour where that is wanted.
#pragma once

#include <ros/node_handle.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "ros/input/image_stream.h"

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

  /// The `place`-th camera, of topics in `ns` (see CameraInput for why); `name` is empty for the
  /// only one.
  Camera(size_t place, std::string name, const std::string& ns, const ros::NodeHandle& nh,
         const NodeParams& params,
         const Parts& parts);

  /// Begins and ends to receive; the latter waits for nobody.
  void subscribe(const ros::NodeHandle& private_nh);
  void unsubscribe();

  /// Intake's thread: see FrameIntake::step().
  std::chrono::milliseconds step() noexcept;

  /// Callbacks' thread: see FrameIntake::startAnew().
  void startAnew();

  /// Intake's thread: see FrameIntake::restartMotion().
  void restartMotion();

  void setPaused(bool paused);
  bool paused() const { return depth_.paused(); }

  /// While subscribed.
  CameraReport report() const;

 private:
  std::unique_ptr<ImageStream> makeColour(const std::string& ns, const ros::NodeHandle& nh,
                                          const NodeParams& params, const Parts& parts);

  size_t place_;
  std::string name_;
  bool is_colour_needed_;
  ImageStream depth_;
  std::unique_ptr<ImageStream> colour_;  ///< Null where none is wanted.
};

}  // namespace dtsdf
