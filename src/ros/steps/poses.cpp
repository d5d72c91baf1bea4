#include "ros/steps/poses.h"

#include <dtsdf_mapping/SaveTrajectory.h>
#include <dtsdf_mapping/SetPose.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <variant>

#include "io/trajectory.h"
#include "params/text.h"
#include "ros/common/requests.h"
#include "ros/common/service.h"
#include "ros/common/status_fields.h"
#include "ros/input/conversions.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"

namespace dtsdf {
namespace {

/// Of the trajectory: three hours of 30 images a second.
constexpr size_t kMostPoses = 360000;

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

std::vector<geometry_msgs::Vector3> toVectors(const std::vector<Eigen::Vector3d>& axes) {
  std::vector<geometry_msgs::Vector3> vectors(axes.size());
  for (size_t i = 0; i < axes.size(); ++i) {
    vectors[i].x = axes[i].x();
    vectors[i].y = axes[i].y();
    vectors[i].z = axes[i].z();
  }
  return vectors;
}

}  // namespace

PosesStep::PosesStep(const Host& host)
    : host_(host),
      params_(host.params.node),
      transforms_(host.transforms),
      cameras_(std::max<size_t>(1, params_.cameras.size()), CameraState(params_.poses)),
      tracker_(params_.poses),
      base_frame_(params_.poses.base_frame) {
  report_.resize(cameras_.size());
}

/// @throws std::runtime_error where poses come from TF as they are.
void PosesStep::requireOn() const {
  if (isOn()) return;
  throw std::runtime_error(
      "poses come from TF as they are; start the node with poses/mode: track, or refine");
}

void PosesStep::advertise(const Handles& handles) {
  if (isOn()) publisher_ = std::make_unique<PosePublisher>(handles.prompt, params_, transforms_);
  using namespace dtsdf_mapping;
  servers_.push_back(
      serve<SetPose>(handles.waiting, "set_pose", [this](const auto& request, auto& response) {
        requireOn();
        const Eigen::Isometry3d T_W_B = host_.frame.find(request.frame_id) * readPose(request.pose);
        host_.map_loop.run([&] { setPose(T_W_B); }).get();
        response.message = "the next depth image is tracked from there";
      }));
  servers_.push_back(serve<SaveTrajectory>(
      handles.waiting, "save_trajectory", [this](const auto& request, auto& response) {
        requireOn();
        const auto copy_poses = [this] {
          return std::make_pair(std::vector<StampedPose>(fused_.begin(), fused_.end()), left_out_);
        };
        const auto [copy, left_out] = host_.map_loop.run(copy_poses).get();
        const std::string path =
            resolveOutputPath(params_.output_directory, request.file_name, {".txt", ".tum"});
        if (copy.empty()) {
          throw std::runtime_error(
              "there is no pose yet: no frame has been fused since the start, clear_map or "
              "load_map");
        }
        saveTrajectory(copy, path);
        response.path = path;
        response.poses = copy.size();
        response.message = "saved " + std::to_string(copy.size()) + " poses to " + path;
        if (left_out > 0) {
          response.message += "; " + std::to_string(left_out) + " older ones are no longer kept";
        }
      }));
}

std::optional<Rejection> PosesStep::expect(PosedFrame& frame) {
  if (!tracks()) return std::nullopt;
  if (auto* const depth = std::get_if<DepthFrame>(&frame.image)) return expectDepth(frame, *depth);
  return expectColour(frame, std::get<ColourFrame>(frame.image));
}

std::optional<Rejection> PosesStep::expectDepth(PosedFrame& frame, DepthFrame& depth) {
  if (params_.poses.base_frame.empty()) base_frame_ = frame.frame_id;
  const PoseAnswer mount = mountOf(frame.frame_id);
  if (!mount.T_W_C) return Rejection{DropReason::kNoTransform, mount.text};
  T_B_C_ = *mount.T_W_C;
  const std::optional<Eigen::Isometry3d> last_T_W_C = tracker_.lastPose();
  if (last_T_W_C) {
    depth.T_W_C = T_W_M().inverse() * *last_T_W_C;
  } else {
    depth.T_W_C = params_.poses.base_frame.empty() ? uprightCamera() : T_B_C_;
  }
  return std::nullopt;
}

std::optional<Rejection> PosesStep::expectColour(PosedFrame& frame, ColourFrame& colour) {
  const std::optional<Eigen::Isometry3d> T_W_C = tracker_.poseAt(frame.stamp.toSec());
  if (!T_W_C) return Rejection{DropReason::kLost, "the depth camera is not followed"};
  const PoseAnswer mount = mountOf(frame.frame_id);
  if (!mount.T_W_C) return Rejection{DropReason::kNoTransform, mount.text};
  colour.T_W_C = T_W_M().inverse() * *T_W_C * T_B_C_.inverse() * *mount.T_W_C;
  return std::nullopt;
}

PoseAnswer PosesStep::mountOf(const std::string& camera_frame) const {
  if (camera_frame != base_frame_) return transforms_.find(base_frame_, camera_frame, ros::Time(0));
  return {Eigen::Isometry3d::Identity()};
}

Eigen::Isometry3d PosesStep::T_W_M() const {
  return host_.frame.level().value_or(Eigen::Isometry3d::Identity());
}

std::optional<Rejection> PosesStep::place(PosedFrame& frame) {
  if (!isOn()) return std::nullopt;
  auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (depth == nullptr) {
    auto& colour = std::get<ColourFrame>(frame.image);
    if (!tracks()) colour.T_W_C = cameras_.at(frame.camera).refiner.T_W_O() * colour.T_W_C;
    return std::nullopt;
  }
  found_ = tracks() ? track(frame, *depth) : refine(frame, *depth);
  depth->T_W_C = found_.T_W_C;
  note(frame, found_);
  if (isToBeFused(frame, found_)) return std::nullopt;
  return Rejection{tracks() ? DropReason::kLost : DropReason::kMisfit, describe(found_)};
}

bool PosesStep::isToBeFused(const PosedFrame& frame, const Alignment& alignment) const {
  return tracks() ? tracker_.isToBeFused(alignment)
                  : cameras_.at(frame.camera).refiner.isToBeFused(alignment);
}

/// Where stamps go back, a recording or the odometry starts over, from where it began before.
Alignment PosesStep::refine(const PosedFrame& frame, const DepthFrame& depth) {
  CameraState& camera = cameras_.at(frame.camera);
  const double back_s = camera.last_stamp.toSec() - frame.stamp.toSec();
  if (back_s > kTimeJump_s) camera.refiner = PoseRefiner(params_.poses);
  camera.last_stamp = frame.stamp;
  Alignment alignment = camera.refiner.refine(host_.map.mapper(), depth);
  if (frame.camera != 0) return alignment;
  T_M_O_ = T_W_M().inverse() * camera.refiner.T_W_O() * T_W_M();
  corrected_at_ = frame.stamp;
  if (publisher_) publisher_->publishCorrection(corrected_at_, T_M_O_);
  return alignment;
}

/// Where stamps go back, the camera is still where it was, as far as anybody knows; so it is where
/// the map is emptied, in which nothing can be found.
Alignment PosesStep::track(const PosedFrame& frame, const DepthFrame& depth) {
  const std::optional<Eigen::Isometry3d> last_T_W_C = tracker_.lastPose();
  if (given_T_W_B_) {
    tracker_.setPose(*given_T_W_B_ * T_B_C_);
  } else if (host_.map.mapper().stats().voxel_arrays == 0) {
    if (last_T_W_C) tracker_.setPose(*last_T_W_C);
  } else if (is_elsewhere_ || !last_T_W_C) {
    tracker_.seek(depth.T_W_C, frame.stamp.toSec());
  }
  given_T_W_B_.reset();
  is_elsewhere_ = false;
  return tracker_.track(host_.map.mapper(), depth, frame.stamp.toSec());
}

void PosesStep::fused(const PosedFrame& frame, const IntegrationResult& result) {
  if (!isOn() || result.status != FrameStatus::kFused) return;
  const auto* const depth = std::get_if<DepthFrame>(&frame.image);
  if (depth == nullptr || frame.camera != 0) return;
  fused_.push_back({frame.stamp.toSec(), depth->T_W_C});
  if (fused_.size() > kMostPoses) {
    fused_.pop_front();
    ++left_out_;
  }
  published_ = foundPose(frame);
  if (published_ && publisher_) publisher_->publish(*published_);
  const std::lock_guard<std::mutex> lock(mutex_);
  trajectory_bytes_ = fused_.size() * sizeof(StampedPose);
}

/// None where it is not known how the camera is fixed to B.
std::optional<FoundPose> PosesStep::foundPose(const PosedFrame& frame) const {
  FoundPose pose;
  pose.stamp = frame.stamp;
  pose.frame_id = params_.poses.base_frame.empty() ? frame.frame_id : params_.poses.base_frame;
  PoseAnswer mount{T_B_C_};
  if (!tracks() && pose.frame_id != frame.frame_id) {
    mount = transforms_.find(pose.frame_id, frame.frame_id, ros::Time(0));
    if (!mount.T_W_C) return std::nullopt;
  }
  const Eigen::Isometry3d T_M_W = T_W_M().inverse();
  pose.T_W_B = found_.T_W_C * mount.T_W_C->inverse();
  pose.T_M_B = T_M_W * pose.T_W_B;
  pose.covariance =
      movedCovariance(odometryCovariance(found_, params_.poses), T_M_W.linear(),
                      T_M_W.linear() * (pose.T_W_B.translation() - found_.T_W_C.translation()));
  return pose;
}

void PosesStep::replaced(const Replacement& replacement) {
  if (!isOn() || replacement.kind == Replacement::Kind::kCorrected) return;
  is_elsewhere_ = true;
  fused_.clear();
  left_out_ = 0;
  if (publisher_) publisher_->clearPath();
  const std::lock_guard<std::mutex> lock(mutex_);
  trajectory_bytes_ = 0;
}

void PosesStep::setPose(const Eigen::Isometry3d& T_W_B) {
  if (!tracks()) {
    throw std::runtime_error(
        "poses come from TF, as poses/mode is refine; only track continues "
        "from a pose that is set");
  }
  given_T_W_B_ = T_W_B;
}

void PosesStep::note(const PosedFrame& frame, const Alignment& alignment) {
  dtsdf_mapping::PoseStatus status;
  status.outcome = toString(alignment.status);
  status.stamp = frame.stamp;
  status.matched_share = static_cast<float>(alignment.matched_share);
  status.inlier_share = static_cast<float>(alignment.inlier_share);
  status.residual_m = static_cast<float>(alignment.residual_m);
  status.correction_m = static_cast<float>(alignment.shift_m);
  status.correction_rad = static_cast<float>(alignment.turn_rad);
  const Eigen::Matrix3d shifts = alignment.covariance.topLeftCorner<3, 3>();
  const Eigen::Matrix3d turns = alignment.covariance.bottomRightCorner<3, 3>();
  status.free_shifts = toVectors(freeAxes(shifts, params_.poses.sigma_m));
  status.free_turns = toVectors(freeAxes(turns, params_.poses.sigma_rad));
  status.lost_since = toTime(tracks() ? tracker_.lostSince_s().value_or(0.0) : 0.0);
  const std::lock_guard<std::mutex> lock(mutex_);
  dtsdf_mapping::PoseStatus& report = report_.at(frame.camera);
  status.outcomes.swap(report.outcomes);
  const auto same = std::find_if(status.outcomes.begin(), status.outcomes.end(),
                                 [&](const auto& known) { return known.reason == status.outcome; });
  if (same == status.outcomes.end()) {
    status.outcomes.push_back(dropCount(status.outcome, 1));
  } else {
    ++same->count;
  }
  report = std::move(status);
}

void PosesStep::fill(MapStatus& status) {
  if (!isOn()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  addMemory(status, "trajectory", kHost, trajectory_bytes_, kMostPoses * sizeof(StampedPose));
  for (size_t i = 0; i < std::min(report_.size(), status.cameras.size()); ++i) {
    status.cameras[i].pose = report_[i];
    if (report_[i].lost_since.isZero()) continue;
    dtsdf::report(
        status, MapStatus::WARN, MapStatus::CAMERA_LOST,
        "the camera is lost, and nothing is fused: move it back slowly to where it was, or call "
        "set_pose, or clear_map to begin again");
  }
  const std::string problem = publisher_ ? publisher_->problem() : "";
  if (!problem.empty()) {
    dtsdf::report(status, MapStatus::WARN, MapStatus::POSES_NOT_PUBLISHED, problem);
  }
}

}  // namespace dtsdf
