/// Poses as service calls give them.
#pragma once

#include <geometry_msgs/Pose.h>

#include <Eigen/Geometry>

namespace dtsdf {

/// An orientation of all zeros is none. @throws std::runtime_error if it is not a rotation either,
/// or the position is not finite.
Eigen::Isometry3d readPose(const geometry_msgs::Pose& pose);

}  // namespace dtsdf
