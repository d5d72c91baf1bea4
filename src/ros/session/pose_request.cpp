#include "ros/session/pose_request.h"

#include <cmath>
#include <stdexcept>

namespace dtsdf {
namespace {

Eigen::Quaterniond readOrientation(const geometry_msgs::Quaternion& q) {
  const Eigen::Quaterniond orientation(q.w, q.x, q.y, q.z);
  const double length = orientation.norm();
  if (length == 0.0) return Eigen::Quaterniond::Identity();
  constexpr double kTolerance = 1e-2;  // people type quaternions with few digits
  if (!(std::abs(length - 1.0) < kTolerance)) {
    throw std::runtime_error(
        "the orientation is not a quaternion of length 1; leave it out for a "
        "pose along the frame's axes");
  }
  return orientation.normalized();
}

}  // namespace

Eigen::Isometry3d readPose(const geometry_msgs::Pose& pose) {
  const Eigen::Vector3d t(pose.position.x, pose.position.y, pose.position.z);
  if (!t.allFinite()) throw std::runtime_error("the position is not finite");
  return Eigen::Translation3d(t) * readOrientation(pose.orientation);
}

}  // namespace dtsdf
