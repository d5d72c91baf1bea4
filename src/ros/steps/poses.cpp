#include "ros/steps/poses.h"

#include <dtsdf_mapping/SaveTrajectory.h>
#include <dtsdf_mapping/SetPose.h>

#include <stdexcept>
#include <utility>

#include "io/trajectory.h"
#include "ros/common/requests.h"
#include "ros/common/service.h"
#include "ros/common/status_fields.h"
#include "ros/input/conversions.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"

namespace dtsdf {
namespace {

std::vector<geometry_msgs::Vector3> toVectors(const std::vector<Eigen::Vector3d>& axes) {
  std::vector<geometry_msgs::Vector3> vectors(axes.size());
  for (size_t i = 0; i < axes.size(); ++i) {
    vectors[i].x = axes[i].x();
    vectors[i].y = axes[i].y();
    vectors[i].z = axes[i].z();
  }
  return vectors;
}

dtsdf_mapping::PoseStatus makePoseStatus(const CameraPoseReport& report) {
  dtsdf_mapping::PoseStatus status;
  if (!report.last) return status;
  status.outcome = toString(report.last->status);
  status.stamp = report.stamp;
  status.matched_share = static_cast<float>(report.last->matched_share);
  status.inlier_share = static_cast<float>(report.last->inlier_share);
  status.residual_m = static_cast<float>(report.last->residual_m);
  status.correction_m = static_cast<float>(report.last->shift_m);
  status.correction_rad = static_cast<float>(report.last->turn_rad);
  status.free_shifts = toVectors(report.free_shifts);
  status.free_turns = toVectors(report.free_turns);
  if (report.lost_since_s) status.lost_since = toTime(*report.lost_since_s);
  for (int i = 0; i < kAlignmentStatusCount; ++i) {
    if (report.outcomes[i] == 0) continue;
    status.outcomes.push_back(
        dropCount(toString(static_cast<AlignmentStatus>(i)), report.outcomes[i]));
  }
  return status;
}

}  // namespace

PosesStep::PosesStep(const Host& host)
    : host_(host),
      poses_(host.params.node, host.transforms, host.frame,
             {[this](const FoundPose& pose) {
                if (publisher_) publisher_->publish(pose);
              },
              [this](const ros::Time& stamp, const Eigen::Isometry3d& T_M_O) {
                if (publisher_) publisher_->publishCorrection(stamp, T_M_O);
              },
              [this] {
                if (publisher_) publisher_->clearPath();
              }}) {}

/// @throws std::runtime_error where poses come from TF as they are.
FramePoses& PosesStep::poses() {
  if (isOn()) return poses_;
  throw std::runtime_error(
      "poses come from TF as they are; start the node with poses/mode: track, or refine");
}

void PosesStep::advertise(const Handles& handles) {
  if (isOn()) {
    publisher_ =
        std::make_unique<PosePublisher>(handles.prompt, host_.params.node, host_.transforms);
  }
  using namespace dtsdf_mapping;
  servers_.push_back(
      serve<SetPose>(handles.waiting, "set_pose", [this](const auto& request, auto& response) {
        FramePoses& poses = this->poses();
        const Eigen::Isometry3d T_W_B = host_.frame.find(request.frame_id) * readPose(request.pose);
        host_.map_loop.run([&] { poses.setPose(T_W_B); }).get();
        response.message = "the next depth image is tracked from there";
      }));
  servers_.push_back(serve<SaveTrajectory>(
      handles.waiting, "save_trajectory", [this](const auto& request, auto& response) {
        const FramePoses& poses = this->poses();
        const auto [copy, left_out] =
            host_.map_loop
                .run([&] {
                  return std::make_pair(poses.fusedPoses().copy(), poses.fusedPoses().leftOut());
                })
                .get();
        const std::string path = resolveOutputPath(host_.params.node.output_directory,
                                                   request.file_name, {".txt", ".tum"});
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
  return isOn() ? poses_.expect(frame) : std::nullopt;
}

std::optional<Rejection> PosesStep::place(PosedFrame& frame) {
  return isOn() ? poses_.place(host_.map.mapper(), frame) : std::nullopt;
}

void PosesStep::fused(const PosedFrame& frame, const IntegrationResult& result) {
  if (isOn() && result.status == FrameStatus::kFused) poses_.wasFused(frame);
}

void PosesStep::replaced(const Replacement& replacement) {
  if (isOn() && replacement.kind != Replacement::Kind::kCorrected) poses_.mapIsAnother();
}

void PosesStep::fill(MapStatus& status) {
  if (!isOn()) return;
  const PoseReport poses = poses_.report();
  addMemory(status, "trajectory", MemoryPlace::kHost, poses.trajectory_bytes,
            poses.max_trajectory_bytes);
  for (size_t i = 0; i < std::min(poses.cameras.size(), status.cameras.size()); ++i) {
    status.cameras[i].pose = makePoseStatus(poses.cameras[i]);
    if (!poses.cameras[i].lost_since_s) continue;
    report(status, MapStatus::WARN, MapStatus::CAMERA_LOST,
           "the camera is lost, and nothing is fused: move it back slowly to where it was, or call "
           "set_pose, or clear_map to begin again");
  }
  const std::string problem = publisher_ ? publisher_->problem() : "";
  if (!problem.empty()) {
    report(status, MapStatus::WARN, MapStatus::POSES_NOT_PUBLISHED, problem);
  }
}

}  // namespace dtsdf
