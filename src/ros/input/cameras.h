/// All cameras of the node, in one order of stamps.
#pragma once

#include <ros/node_handle.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ros/input/camera.h"

namespace dtsdf {

/// The namespace that the node is in, and the topics that it reads; empty for the root.
std::string namespaceOf(const ros::NodeHandle& private_nh);

/// Each camera of the setting `cameras` has its topics in its namespace; without that setting there
/// is one camera in the node's own. Callbacks come on one thread at a time.
class Cameras {
 public:
  /// `poses` and `posed_frames` outlive it; `on_frame` says that something waits for step().
  Cameras(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh, const NodeParams& params,
          PoseSource& poses, FrameQueue& posed_frames, std::function<void()> on_frame);

  void subscribe(const ros::NodeHandle& private_nh);
  void unsubscribe();

  /// Intake's thread: see FrameIntake::step().
  std::chrono::milliseconds step() noexcept;

  /// Intake's thread: see FrameIntake::restartMotion().
  void restartMotion();

  /// See FrameIntake::setPaused().
  void setPaused(bool paused);
  bool paused() const { return cameras_.front()->paused(); }

  /// In the order of the setting; while subscribed.
  std::vector<CameraReport> report() const;

 private:
  void startAnew();

  PoseSource& poses_;
  FrameQueue& posed_frames_;
  std::vector<std::unique_ptr<Camera>> cameras_;  ///< At least one.
};

}  // namespace dtsdf
