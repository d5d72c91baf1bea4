/// The steps of poses/mode refine and track: where depth images lie in the map.
#pragma once

#include <ros/node_handle.h>

#include <Eigen/Geometry>
#include <vector>

#include "ros/steps/frame_poses.h"
#include "ros/steps/pose_publisher.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// Aligns frames to the map, publishes where they are, and serves set_pose and save_trajectory. The
/// one place that knows where poses come from.
class PosesStep : public Step {
 public:
  explicit PosesStep(const Host& host);

  void advertise(const Handles& handles) override;
  std::optional<Rejection> place(PosedFrame& frame) override;
  void fused(const PosedFrame& frame, const IntegrationResult& result) override;
  void replaced(const Replacement& replacement) override;
  void fill(dtsdf_mapping::MapStatus& status) override;

  /// Before the map is level: the pose that a frame without one is expected at.
  std::optional<Rejection> expect(PosedFrame& frame);

 private:
  bool isOn() const { return host_.params.node.poses.mode != PoseMode::kTf; }
  FramePoses& poses();

  const Host& host_;
  FramePoses poses_;
  std::unique_ptr<PosePublisher> publisher_;  ///< From advertise() on.
  std::vector<ros::ServiceServer> servers_;
};

/// Goes before the level, which looks at poses.
class ExpectStep : public Step {
 public:
  explicit ExpectStep(PosesStep& poses) : poses_(poses) {}
  std::optional<Rejection> place(PosedFrame& frame) override { return poses_.expect(frame); }

 private:
  PosesStep& poses_;
};

}  // namespace dtsdf
