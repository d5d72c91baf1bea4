/// One kind of a camera's images: its topics, its frames on their way to the map, and what became
/// of them.
#pragma once

#include <ros/node_handle.h>

#include <functional>
#include <memory>
#include <string>

#include "dtsdf_mapping/io/rate_limit.h"
#include "ros/input/camera_input.h"
#include "ros/input/camera_report.h"
#include "ros/input/frame_intake.h"

namespace dtsdf {

class ImageStream {
 public:
  /// Of topics in `ns` (see CameraInput for why). `on_frame` reports that something waits for the
  /// intake's thread.
  ImageStream(const std::string& ns, const ros::NodeHandle& nh, const InputParams& params,
              ImageKind kind, const FrameIntake::Parts& parts, std::function<void()> on_frame);

  /// Begins and ends to receive; the latter waits for nobody.
  void subscribe(const ros::NodeHandle& private_nh);
  void unsubscribe() { input_.reset(); }

  /// Where its frames wait.
  FrameIntake& intake() { return intake_; }

  /// While subscribed.
  StreamReport report() const;

 private:
  void onFrame(const FrameMessages& frame);
  void makeRoom();

  std::string ns_;
  ros::NodeHandle nh_;
  InputParams params_;
  const ImageKind kind_;
  std::function<void()> on_frame_;
  RateLimit rate_limit_;  ///< Callbacks' thread only.
  FrameAccounting& accounting_;
  FrameIntake intake_;
  std::unique_ptr<CameraInput> input_;
};

}  // namespace dtsdf
