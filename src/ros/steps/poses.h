/// The step of poses/mode: where depth images lie in the map, moved from TF's pose, or found by it.
#pragma once

#include <dtsdf_mapping/PoseStatus.h>
#include <ros/node_handle.h>
#include <ros/time.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/pose_refiner.h"
#include "dtsdf_mapping/pose_tracker.h"
#include "io/trajectory.h"
#include "params/node_params.h"
#include "ros/input/transforms.h"
#include "ros/steps/pose_publisher.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// With poses/mode refine and track; else poses stay as they are. With refine each camera is
/// aligned by itself, and the first one is who speaks for all: its correction and its poses are
/// published. The one place that knows where poses come from; serves set_pose and save_trajectory.
class PosesStep : public Step {
 public:
  explicit PosesStep(const Host& host);

  void advertise(const Handles& handles) override;
  /// Gives a frame the pose in M that is expected of it, where it has none by TF: with track.
  std::optional<Rejection> expect(PosedFrame& frame) override;
  /// Brings the pose of a frame from where it was expected, in W, to where it is to be fused or
  /// painted. @throws std::exception when the backend fails.
  std::optional<Rejection> place(PosedFrame& frame) override;
  void fused(const PosedFrame& frame, const IntegrationResult& result) override;
  /// A camera that is tracked continues from where it is in an empty map; in any other it may be
  /// anywhere, and has to be found.
  void replaced(const Replacement& replacement) override;
  void fill(dtsdf_mapping::MapStatus& status) override;

  /// Sets where B is: the next image is there. @throws std::runtime_error unless it tracks.
  void setPose(const Eigen::Isometry3d& T_W_B);

  /// The trajectory so far: poses of the first camera's frames in the map, in the order of fusing.
  const std::deque<StampedPose>& fusedPoses() const { return fused_; }
  /// What was published last, whoever listens.
  const std::optional<FoundPose>& published() const { return published_; }
  /// With refine, what moves the given poses of the first camera.
  const Eigen::Isometry3d& T_M_O() const { return T_M_O_; }
  /// Stamp of the image for which that was published last.
  const ros::Time& correctedAt() const { return corrected_at_; }

 private:
  /// Of one camera.
  struct CameraState {
    explicit CameraState(const PoseParams& params) : refiner(params) {}

    PoseRefiner refiner;   ///< With refine.
    ros::Time last_stamp;  ///< Of its newest depth image.
  };

  bool isOn() const { return params_.poses.mode != PoseMode::kTf; }
  bool tracks() const { return params_.poses.mode == PoseMode::kTrack; }
  void requireOn() const;
  std::optional<Rejection> expectDepth(PosedFrame& frame, DepthFrame& depth);
  std::optional<Rejection> expectColour(PosedFrame& frame, ColourFrame& colour);
  Alignment refine(const PosedFrame& frame, const DepthFrame& depth);
  Alignment track(const PosedFrame& frame, const DepthFrame& depth);
  bool isToBeFused(const PosedFrame& frame, const Alignment& alignment) const;
  std::optional<FoundPose> foundPose(const PosedFrame& frame) const;
  /// Pose of a camera in B.
  PoseAnswer mountOf(const std::string& camera_frame) const;
  Eigen::Isometry3d T_W_M() const;
  void note(const PosedFrame& frame, const Alignment& alignment);

  const Host& host_;
  const NodeParams& params_;
  const Transforms& transforms_;
  std::vector<CameraState> cameras_;
  PoseTracker tracker_;
  std::string base_frame_;                                   ///< Name of B, once it is known.
  Eigen::Isometry3d T_B_C_ = Eigen::Isometry3d::Identity();  ///< With track, of the newest image.
  std::optional<Eigen::Isometry3d> given_T_W_B_;             ///< By setPose(), for the next image.
  bool is_elsewhere_ = false;  ///< Until the next image: see replaced().
  Alignment found_;            ///< Of the newest image.
  std::optional<FoundPose> published_;
  Eigen::Isometry3d T_M_O_ = Eigen::Isometry3d::Identity();
  ros::Time corrected_at_;
  std::deque<StampedPose> fused_;
  size_t left_out_ = 0;  ///< Of the oldest ones.

  std::unique_ptr<PosePublisher> publisher_;  ///< From advertise() on.
  std::vector<ros::ServiceServer> servers_;

  mutable std::mutex mutex_;                       ///< Guards what follows.
  std::vector<dtsdf_mapping::PoseStatus> report_;  ///< Of each camera.
  size_t trajectory_bytes_ = 0;
};

}  // namespace dtsdf
