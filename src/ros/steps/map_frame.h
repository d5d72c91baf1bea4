/// The frame that the map is in: map_frame itself, or one that is level, once up is known; and
/// where other frames are in it.
#pragma once

#include <ros/time.h>

#include <Eigen/Geometry>
#include <mutex>
#include <optional>
#include <string>

#include "params/node_params.h"
#include "ros/input/transforms.h"

namespace dtsdf {

/// Thread safe.
class MapFrame {
 public:
  /// Both outlive it.
  MapFrame(const MappingParams& params, const Transforms& transforms)
      : params_(params), transforms_(transforms) {}

  /// Whether the map has a frame of its own.
  bool isLevelled() const { return dtsdf::isLevelled(params_.node); }

  /// T_W_M; none where the map is in map_frame, or up is not known yet.
  std::optional<Eigen::Isometry3d> level() const;
  void setLevel(const Eigen::Isometry3d& T_W_M);
  /// Why up is not known, and what to do.
  std::string levelProblem() const;
  void setLevelProblem(const std::string& text);

  /// What is in M, in W. @throws std::runtime_error while up is not known.
  Eigen::Isometry3d inMap(const Eigen::Isometry3d& T_M_F) const;

  /// Of a frame, at a time; 0: by the newest transform. An empty name is the frame of the map. A
  /// transform of just now may be on its way; as long as that of an image is waited for.
  /// @throws std::runtime_error where there is none.
  Eigen::Isometry3d find(const std::string& frame_id, const ros::Time& stamp = ros::Time(0)) const;

  /// Where map/keep_frame is at the stamp, or else now; none where it is not known, or not set.
  std::optional<Eigen::Vector3d> keepCenterAt(const ros::Time& stamp) const;

 private:
  /// Of the frames that need no transform.
  std::optional<Eigen::Isometry3d> poseOfFixed(const std::string& frame) const;

  const MappingParams& params_;
  const Transforms& transforms_;

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::optional<Eigen::Isometry3d> T_W_M_;
  std::string level_problem_;
};

}  // namespace dtsdf
