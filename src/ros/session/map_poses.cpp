#include "ros/session/map_poses.h"

#include <ros/console.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "params/frame_name.h"
#include "ros/common/steady_clock.h"

namespace dtsdf {

Eigen::Isometry3d MapPoses::find(const std::string& frame_id, const ros::Time& stamp) const {
  const std::string frame = stripLeadingSlash(frame_id);
  if (frame.empty()) return Eigen::Isometry3d::Identity();
  if (const auto fixed = poseOfFixed(frame)) return *fixed;
  const PoseAnswer answer = waitFor(frame, stamp);
  if (answer.kind != PoseAnswer::Kind::kKnown) throw std::runtime_error(answer.text);
  return levelling_.inMap(answer.T_W_C);
}

std::optional<Eigen::Isometry3d> MapPoses::poseOfFixed(const std::string& frame) const {
  if (frame == frameOfMap(params_.node)) return Eigen::Isometry3d::Identity();
  if (frame == poses_.mapFrame()) return levelling_.inMap(Eigen::Isometry3d::Identity());
  return std::nullopt;
}

PoseAnswer MapPoses::waitFor(const std::string& frame, const ros::Time& stamp) const {
  const auto end =
      std::chrono::steady_clock::now() + toSteadyDuration(params_.node.input.tf_timeout_s);
  for (;;) {
    PoseAnswer answer = poses_.find(frame, stamp);
    if (answer.kind != PoseAnswer::Kind::kNotYet || stamp.isZero()) return answer;
    if (std::chrono::steady_clock::now() >= end) return answer;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

std::optional<Eigen::Vector3d> MapPoses::keepCenterAt(const ros::Time& stamp) const {
  const std::string& frame = params_.node.keep_frame;
  if (frame.empty() || params_.mapper.map.keep_radius_m == 0.0f) return std::nullopt;
  if (const auto fixed = poseOfFixed(frame)) return fixed->translation();
  for (const ros::Time& time : {stamp, ros::Time(0)}) {
    const PoseAnswer answer = poses_.lookUp(frame, time);
    if (answer.kind == PoseAnswer::Kind::kKnown) {
      return levelling_.inMap(answer.T_W_C).translation();
    }
    if (!time.isZero()) continue;
    ROS_WARN_STREAM_THROTTLE_NAMED(10.0, "dtsdf_mapping",
                                   "map/keep_radius_m is centred on the camera, because "
                                   "map/keep_frame is not known: "
                                       << answer.text);
  }
  return std::nullopt;
}

}  // namespace dtsdf
