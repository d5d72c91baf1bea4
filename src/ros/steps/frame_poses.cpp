#include "ros/steps/frame_poses.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <variant>

#include "params/text.h"

namespace dtsdf {
namespace {

/// Of a camera that is held upright, in a frame with x ahead and z up: where tracking begins.
Eigen::Isometry3d uprightCamera() {
  Eigen::Isometry3d T_B_C = Eigen::Isometry3d::Identity();
  T_B_C.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return T_B_C;
}

std::string describe(const Alignment& alignment) {
  return formatted("%s: %ld %% of the image lie near surfaces of the map, and %ld %% of these fit",
                   toString(alignment.status), std::lround(100.0 * alignment.matched_share),
                   std::lround(100.0 * alignment.inlier_share));
}

}  // namespace

FramePoses::FramePoses(const NodeParams& params, const Transforms& transforms,
                       const MapFrame& frame, Listeners listeners)
    : params_(params),
      transforms_(transforms),
      frame_(frame),
      listeners_(std::move(listeners)),
      cameras_(std::max<size_t>(1, params.cameras.size()), CameraState(params.poses)),
      tracker_(params.poses),
      base_frame_(params.poses.base_frame) {
  report_.cameras.resize(cameras_.size());
  report_.max_trajectory_bytes = fused_.maxBytes();
}

std::optional<Rejection> FramePoses::expect(PosedFrame& frame) {
  if (!tracks()) return std::nullopt;
  if (auto* const depth = std::get_if<DepthFrame>(&frame.image)) return expectDepth(frame, *depth);
  return expectColour(frame, std::get<ColourFrame>(frame.image));
}

std::optional<Rejection> FramePoses::expectDepth(PosedFrame& frame, DepthFrame& depth) {
  if (params_.poses.base_frame.empty()) base_frame_ = frame.frame_id;
  const PoseAnswer mount = mountOf(frame.frame_id);
  if (mount.kind != PoseAnswer::Kind::kKnown) {
    return Rejection{DropReason::kNoTransform, mount.text};
  }
  T_B_C_ = mount.T_W_C;
  const std::optional<Eigen::Isometry3d> last_T_W_C = tracker_.lastPose();
  if (last_T_W_C) {
    depth.T_W_C = T_W_M().inverse() * *last_T_W_C;
  } else {
    depth.T_W_C = params_.poses.base_frame.empty() ? uprightCamera() : T_B_C_;
  }
  return std::nullopt;
}

std::optional<Rejection> FramePoses::expectColour(PosedFrame& frame, ColourFrame& colour) {
  const std::optional<Eigen::Isometry3d> T_W_C = tracker_.poseAt(frame.stamp.toSec());
  if (!T_W_C) return Rejection{DropReason::kLost, "the depth camera is not followed"};
  const PoseAnswer mount = mountOf(frame.frame_id);
  if (mount.kind != PoseAnswer::Kind::kKnown) {
    return Rejection{DropReason::kNoTransform, mount.text};
  }
  colour.T_W_C = T_W_M().inverse() * *T_W_C * T_B_C_.inverse() * mount.T_W_C;
  return std::nullopt;
}

PoseAnswer FramePoses::mountOf(const std::string& camera_frame) const {
  if (camera_frame != base_frame_) return transforms_.find(base_frame_, camera_frame, ros::Time(0));
  return {PoseAnswer::Kind::kKnown, Eigen::Isometry3d::Identity(), ""};
}

Eigen::Isometry3d FramePoses::T_W_M() const {
  return frame_.level().value_or(Eigen::Isometry3d::Identity());
}

std::optional<Rejection> FramePoses::place(Mapper& mapper, PosedFrame& frame) {
  auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (depth == nullptr) {
    auto& colour = std::get<ColourFrame>(frame.image);
    if (!tracks()) colour.T_W_C = cameras_.at(frame.camera).refiner.T_W_O() * colour.T_W_C;
    return std::nullopt;
  }
  found_ = tracks() ? track(mapper, frame, *depth) : refine(mapper, frame, *depth);
  depth->T_W_C = found_.T_W_C;
  note(frame, found_);
  if (isToBeFused(frame, found_)) return std::nullopt;
  return Rejection{tracks() ? DropReason::kLost : DropReason::kMisfit, describe(found_)};
}

bool FramePoses::isToBeFused(const PosedFrame& frame, const Alignment& alignment) const {
  return tracks() ? tracker_.isToBeFused(alignment)
                  : cameras_.at(frame.camera).refiner.isToBeFused(alignment);
}

/// Where stamps go back, a recording or the odometry begins anew, from where it began before.
Alignment FramePoses::refine(Mapper& mapper, const PosedFrame& frame, const DepthFrame& depth) {
  CameraState& camera = cameras_.at(frame.camera);
  const double back_s = camera.last_stamp.toSec() - frame.stamp.toSec();
  if (back_s > kTimeJump_s) camera.refiner = PoseRefiner(params_.poses);
  camera.last_stamp = frame.stamp;
  Alignment alignment = camera.refiner.refine(mapper, depth);
  if (frame.camera == 0) {
    listeners_.on_correction(frame.stamp, T_W_M().inverse() * camera.refiner.T_W_O() * T_W_M());
  }
  return alignment;
}

/// Where stamps go back, the camera is still where it was, as far as anybody knows; so it is where
/// the map is emptied, in which nothing can be found any more.
Alignment FramePoses::track(Mapper& mapper, const PosedFrame& frame, const DepthFrame& depth) {
  const std::optional<Eigen::Isometry3d> last_T_W_C = tracker_.lastPose();
  if (given_T_W_B_) {
    tracker_.setPose(*given_T_W_B_ * T_B_C_);
  } else if (mapper.stats().voxel_arrays == 0) {
    if (last_T_W_C) tracker_.setPose(*last_T_W_C);
  } else if (is_elsewhere_ || !last_T_W_C) {
    tracker_.seek(depth.T_W_C, frame.stamp.toSec());
  }
  given_T_W_B_.reset();
  is_elsewhere_ = false;
  return tracker_.track(mapper, depth, frame.stamp.toSec());
}

void FramePoses::wasFused(const PosedFrame& frame) {
  const auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (depth == nullptr || frame.camera != 0) return;
  fused_.add({frame.stamp.toSec(), depth->T_W_C});
  if (const auto pose = foundPose(frame)) listeners_.on_pose(*pose);
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.trajectory_bytes = fused_.bytes();
}

/// None where it is not known how the camera is fixed to B.
std::optional<FoundPose> FramePoses::foundPose(const PosedFrame& frame) const {
  FoundPose pose;
  pose.stamp = frame.stamp;
  pose.frame_id = params_.poses.base_frame.empty() ? frame.frame_id : params_.poses.base_frame;
  PoseAnswer mount{PoseAnswer::Kind::kKnown, T_B_C_, ""};
  if (!tracks() && pose.frame_id != frame.frame_id) {
    mount = transforms_.find(pose.frame_id, frame.frame_id, ros::Time(0));
    if (mount.kind != PoseAnswer::Kind::kKnown) return std::nullopt;
  }
  const Eigen::Isometry3d T_M_W = T_W_M().inverse();
  pose.T_W_B = found_.T_W_C * mount.T_W_C.inverse();
  pose.T_M_B = T_M_W * pose.T_W_B;
  pose.covariance =
      movedCovariance(odometryCovariance(found_, params_.poses), T_M_W.linear(),
                      T_M_W.linear() * (pose.T_W_B.translation() - found_.T_W_C.translation()));
  return pose;
}

void FramePoses::mapIsAnother() {
  is_elsewhere_ = true;
  fused_.clear();
  listeners_.on_new_map();
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.trajectory_bytes = 0;
}

void FramePoses::setPose(const Eigen::Isometry3d& T_W_B) {
  if (!tracks()) {
    throw std::runtime_error(
        "poses come from TF, as poses/mode is refine; only track continues "
        "from a pose that is set");
  }
  given_T_W_B_ = T_W_B;
}

void FramePoses::note(const PosedFrame& frame, const Alignment& alignment) {
  const std::lock_guard<std::mutex> lock(mutex_);
  CameraPoseReport& report = report_.cameras.at(frame.camera);
  report.last = alignment;
  report.stamp = frame.stamp;
  const Eigen::Matrix3d shifts = alignment.covariance.topLeftCorner<3, 3>();
  const Eigen::Matrix3d turns = alignment.covariance.bottomRightCorner<3, 3>();
  report.free_shifts = freeAxes(shifts, params_.poses.sigma_m);
  report.free_turns = freeAxes(turns, params_.poses.sigma_rad);
  report.lost_since_s = tracks() ? tracker_.lostSince_s() : std::nullopt;
  ++report.outcomes.at(static_cast<size_t>(alignment.status));
}

PoseReport FramePoses::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return report_;
}

}  // namespace dtsdf
