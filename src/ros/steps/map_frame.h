/// The map frame W, which is either map_frame (M) or a levelled frame, and the poses of other
/// frames in W.
#pragma once

#include <ros/console.h>
#include <ros/time.h>

#include <Eigen/Geometry>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "params/node_params.h"
#include "params/text.h"
#include "ros/common/pace.h"
#include "ros/input/transforms.h"

namespace dtsdf {

/// Thread-safe.
class MapFrame {
 public:
  /// Both references must outlive this object.
  MapFrame(const NodeParams& params, const Transforms& transforms)
      : params_(params), transforms_(transforms) {}

  /// Whether W differs from M.
  bool isLevelled() const { return dtsdf::isLevelled(params_); }

  /// T_W_M; none if the map is not levelled, or the vertical is not known yet.
  std::optional<Eigen::Isometry3d> level() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return T_W_M_;
  }
  void setLevel(const Eigen::Isometry3d& T_W_M) {
    const std::lock_guard<std::mutex> lock(mutex_);
    T_W_M_ = T_W_M;
  }

  /// Pose in W of a frame whose pose in M is given.
  /// @throws std::runtime_error while the vertical is unknown.
  Eigen::Isometry3d inMap(const Eigen::Isometry3d& T_M_F) const {
    if (!isLevelled()) return T_M_F;
    if (const auto T_W_M = level()) return *T_W_M * T_M_F;
    throw std::runtime_error("the map is not levelled yet; the status says why");
  }

  /// Pose of a frame in W at a stamp; stamp 0 means the newest transform. An empty name means W. If
  /// the transform for a stamp may still arrive, waits for up to input/tf_timeout_s.
  /// @throws std::runtime_error if there is none.
  Eigen::Isometry3d find(const std::string& frame_id, const ros::Time& stamp = ros::Time(0)) const {
    const std::string frame = stripLeadingSlash(frame_id);
    if (frame.empty()) return Eigen::Isometry3d::Identity();
    if (const auto fixed = poseOfFixed(frame)) return *fixed;
    const SteadyTime end =
        std::chrono::steady_clock::now() + toSteadyDuration(params_.input.tf_timeout_s);
    for (;;) {
      const PoseAnswer answer = transforms_.find(params_.map_frame, frame, stamp);
      if (answer.T_W_C) return inMap(*answer.T_W_C);
      const bool waits = answer.may_come && !stamp.isZero();
      if (!waits || std::chrono::steady_clock::now() >= end) throw std::runtime_error(answer.text);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

  /// Position of map/keep_frame at the stamp, or in the newest transform if the stamp has none.
  /// Nothing if the position is unknown, or if no frame or no map/keep_radius_m is set.
  std::optional<Eigen::Vector3d> keepCenterAt(const ros::Time& stamp) const {
    const std::string& frame = params_.keep_frame;
    if (frame.empty() || params_.mapper.map.keep_radius_m == 0.0f) return std::nullopt;
    if (const auto fixed = poseOfFixed(frame)) return fixed->translation();
    PoseAnswer answer = transforms_.find(params_.map_frame, frame, stamp);
    if (!answer.T_W_C) answer = transforms_.find(params_.map_frame, frame, ros::Time(0));
    if (answer.T_W_C) return inMap(*answer.T_W_C).translation();
    ROS_WARN_STREAM_THROTTLE_NAMED(10.0, "dtsdf_mapping",
                                   "map/keep_radius_m is centred on the camera, because "
                                   "the pose of map/keep_frame is unknown: "
                                       << answer.text);
    return std::nullopt;
  }

 private:
  /// Pose in W of the frames W and M, which need no transform; none for other frames.
  std::optional<Eigen::Isometry3d> poseOfFixed(const std::string& frame) const {
    if (frame == frameOfMap(params_)) return Eigen::Isometry3d::Identity();
    if (frame == params_.map_frame) return inMap(Eigen::Isometry3d::Identity());
    return std::nullopt;
  }

  const NodeParams& params_;
  const Transforms& transforms_;

  mutable std::mutex mutex_;  ///< Guards T_W_M_.
  std::optional<Eigen::Isometry3d> T_W_M_;
};

}  // namespace dtsdf
