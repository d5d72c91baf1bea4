#include "ros/steps/map_frame.h"

#include <ros/console.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "params/text.h"
#include "ros/common/pace.h"

namespace dtsdf {

std::optional<Eigen::Isometry3d> MapFrame::level() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return T_W_M_;
}

void MapFrame::setLevel(const Eigen::Isometry3d& T_W_M) {
  const std::lock_guard<std::mutex> lock(mutex_);
  T_W_M_ = T_W_M;
  level_problem_.clear();
}

std::string MapFrame::levelProblem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return level_problem_;
}

void MapFrame::setLevelProblem(const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  level_problem_ = text;
}

Eigen::Isometry3d MapFrame::inMap(const Eigen::Isometry3d& T_M_F) const {
  if (!isLevelled()) return T_M_F;
  const std::optional<Eigen::Isometry3d> T_W_M = level();
  if (!T_W_M) throw std::runtime_error("the map is not level yet: " + levelProblem());
  return *T_W_M * T_M_F;
}

Eigen::Isometry3d MapFrame::find(const std::string& frame_id, const ros::Time& stamp) const {
  const std::string frame = stripLeadingSlash(frame_id);
  if (frame.empty()) return Eigen::Isometry3d::Identity();
  if (const auto fixed = poseOfFixed(frame)) return *fixed;
  const SteadyTime end =
      std::chrono::steady_clock::now() + toSteadyDuration(params_.node.input.tf_timeout_s);
  for (;;) {
    const PoseAnswer answer = transforms_.find(params_.node.map_frame, frame, stamp);
    if (answer.T_W_C) return inMap(*answer.T_W_C);
    const bool may_come = answer.may_come && !stamp.isZero();
    if (!may_come || std::chrono::steady_clock::now() >= end) throw std::runtime_error(answer.text);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

std::optional<Eigen::Isometry3d> MapFrame::poseOfFixed(const std::string& frame) const {
  if (frame == frameOfMap(params_.node)) return Eigen::Isometry3d::Identity();
  if (frame == params_.node.map_frame) return inMap(Eigen::Isometry3d::Identity());
  return std::nullopt;
}

std::optional<Eigen::Vector3d> MapFrame::keepCenterAt(const ros::Time& stamp) const {
  const std::string& frame = params_.node.keep_frame;
  if (frame.empty() || params_.mapper.map.keep_radius_m == 0.0f) return std::nullopt;
  if (const auto fixed = poseOfFixed(frame)) return fixed->translation();
  for (const ros::Time& time : {stamp, ros::Time(0)}) {
    const PoseAnswer answer = transforms_.find(params_.node.map_frame, frame, time);
    if (answer.T_W_C) return inMap(*answer.T_W_C).translation();
    if (!time.isZero()) continue;
    ROS_WARN_STREAM_THROTTLE_NAMED(10.0, "dtsdf_mapping",
                                   "map/keep_radius_m is centred on the camera, because "
                                   "map/keep_frame is not known: "
                                       << answer.text);
  }
  return std::nullopt;
}

}  // namespace dtsdf
