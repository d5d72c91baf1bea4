/// Where frames are in the map, for services and for map/keep_radius_m.
#pragma once

#include <ros/time.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "params/node_params.h"
#include "ros/input/pose_source.h"
#include "ros/session/levelling.h"

namespace dtsdf {

/// Thread safe.
class MapPoses {
 public:
  /// All of it outlives it.
  MapPoses(const MappingParams& params, const PoseSource& poses, const Levelling& levelling)
      : params_(params), poses_(poses), levelling_(levelling) {}

  /// Of a frame, at a time; 0: by the newest transform. An empty name is the frame of the map. A
  /// transform of just now may be on its way; as long as that of an image is waited for.
  /// @throws std::runtime_error where there is none.
  Eigen::Isometry3d find(const std::string& frame_id, const ros::Time& stamp = ros::Time(0)) const;

  /// Where map/keep_frame is at the stamp, or else now; none where it is not known, or not set.
  std::optional<Eigen::Vector3d> keepCenterAt(const ros::Time& stamp) const;

 private:
  PoseAnswer waitFor(const std::string& frame, const ros::Time& stamp) const;
  /// Of the frames that need no transform.
  std::optional<Eigen::Isometry3d> poseOfFixed(const std::string& frame) const;

  const MappingParams& params_;
  const PoseSource& poses_;
  const Levelling& levelling_;
};

}  // namespace dtsdf
