/// Where depth images lie in the map, by poses/mode: moved from TF's pose, or found by the map.
#pragma once

#include <ros/time.h>

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/pose_refiner.h"
#include "dtsdf_mapping/pose_tracker.h"
#include "io/trajectory.h"
#include "params/node_params.h"
#include "ros/input/frame.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/transforms.h"
#include "ros/steps/map_frame.h"
#include "ros/steps/pose_publisher.h"

namespace dtsdf {

/// The trajectory so far, in bounded memory. Poses of frames that were fused; of more than `most`
/// the oldest go.
class FusedPoses {
 public:
  static constexpr size_t kMost = 360000;  ///< Three hours of 30 images a second.

  explicit FusedPoses(size_t most = kMost) : most_(most) {}

  void add(const StampedPose& pose) {
    poses_.push_back(pose);
    if (poses_.size() <= most_) return;
    poses_.pop_front();
    ++left_out_;
  }

  void clear() {
    poses_.clear();
    left_out_ = 0;
  }

  std::vector<StampedPose> copy() const { return {poses_.begin(), poses_.end()}; }
  size_t leftOut() const { return left_out_; }
  size_t bytes() const { return poses_.size() * sizeof(StampedPose); }
  size_t maxBytes() const { return most_ * sizeof(StampedPose); }

 private:
  size_t most_;
  std::deque<StampedPose> poses_;
  size_t left_out_ = 0;
};

constexpr int kAlignmentStatusCount = static_cast<int>(AlignmentStatus::kUnsure) + 1;

/// How the depth images of one camera fit the map.
struct CameraPoseReport {
  std::optional<Alignment> last;                         ///< Of the newest image.
  ros::Time stamp;                                       ///< Of that one.
  std::vector<Eigen::Vector3d> free_shifts, free_turns;  ///< See freeAxes().
  std::optional<double> lost_since_s;  ///< First image that did not fit; none: followed.
  std::array<uint64_t, kAlignmentStatusCount> outcomes{};  ///< Images, by AlignmentStatus.
};

struct PoseReport {
  std::vector<CameraPoseReport> cameras;  ///< In their order.
  size_t trajectory_bytes = 0, max_trajectory_bytes = 0;
};

/// For poses/mode refine and track. With refine each camera is aligned by itself, and the first one
/// is who speaks for all: its correction and its poses are published. Map's thread only, but for
/// report().
class FramePoses {
 public:
  /// Who hears of poses. Called on the map's thread.
  struct Listeners {
    std::function<void(const FoundPose&)> on_pose;  ///< Of a frame that was fused.
    std::function<void(const ros::Time&, const Eigen::Isometry3d& T_M_O)> on_correction;
    std::function<void()> on_new_map;  ///< The poses so far are of a map that is gone.
  };

  /// `transforms` and `frame` outlive it.
  FramePoses(const NodeParams& params, const Transforms& transforms, const MapFrame& frame,
             Listeners listeners);

  /// Gives a frame the pose in M that is expected of it, where it has none by TF: with track.
  /// Returns why it cannot be used, if so.
  std::optional<Rejection> expect(PosedFrame& frame);

  /// Brings the pose of a frame from where it was expected, in W, to where it is to be fused or
  /// painted. Returns why it is not to be, if so. @throws std::exception when the backend fails.
  std::optional<Rejection> place(Mapper& mapper, PosedFrame& frame);

  /// The frame that place() was called with last has been fused.
  void wasFused(const PosedFrame& frame);

  /// The map was emptied, or replaced by another one. A camera that is tracked goes on from where
  /// it is in an empty map; in any other it may be anywhere, and has to be found.
  void mapIsAnother();

  /// Sets where B is: the next image is there. @throws std::runtime_error unless it tracks.
  void setPose(const Eigen::Isometry3d& T_W_B);

  /// Of the first camera's frames in the map, in the order of fusing.
  const FusedPoses& fusedPoses() const { return fused_; }

  PoseReport report() const;

 private:
  /// Of one camera.
  struct CameraState {
    explicit CameraState(const PoseParams& params) : refiner(params) {}

    PoseRefiner refiner;   ///< With refine.
    ros::Time last_stamp;  ///< Of its newest depth image.
  };

  bool tracks() const { return params_.poses.mode == PoseMode::kTrack; }
  std::optional<Rejection> expectDepth(PosedFrame& frame, DepthFrame& depth);
  std::optional<Rejection> expectColour(PosedFrame& frame, ColourFrame& colour);
  Alignment refine(Mapper& mapper, const PosedFrame& frame, const DepthFrame& depth);
  Alignment track(Mapper& mapper, const PosedFrame& frame, const DepthFrame& depth);
  bool isToBeFused(const PosedFrame& frame, const Alignment& alignment) const;
  std::optional<FoundPose> foundPose(const PosedFrame& frame) const;
  /// Pose of a camera in B.
  PoseAnswer mountOf(const std::string& camera_frame) const;
  Eigen::Isometry3d T_W_M() const;
  void note(const PosedFrame& frame, const Alignment& alignment);

  const NodeParams& params_;
  const Transforms& transforms_;
  const MapFrame& frame_;
  const Listeners listeners_;
  std::vector<CameraState> cameras_;
  PoseTracker tracker_;
  std::string base_frame_;                                   ///< Name of B, once it is known.
  Eigen::Isometry3d T_B_C_ = Eigen::Isometry3d::Identity();  ///< With track, of the newest image.
  std::optional<Eigen::Isometry3d> given_T_W_B_;             ///< By setPose(), for the next image.
  bool is_elsewhere_ = false;  ///< Until the next image: see mapIsAnother().
  Alignment found_;            ///< Of the newest image.
  FusedPoses fused_;

  mutable std::mutex mutex_;  ///< Guards what follows.
  PoseReport report_;
};

}  // namespace dtsdf
