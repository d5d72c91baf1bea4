/// Conversions between ROS messages and this package's types.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/time.h>
#include <sensor_msgs/Imu.h>
#include <tf2_eigen/tf2_eigen.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "level/still_gravity.h"

namespace dtsdf {

/// End of ROS time; ros::Time throws for values that round to it.
constexpr double kEndOfTime_s = 4294967296.0;

/// Clamps to the range of ROS time; 0 for a stamp that is not finite.
inline ros::Time toTime(double stamp_s) {
  return std::isfinite(stamp_s) ? ros::Time(std::clamp(stamp_s, 0.0, kEndOfTime_s - 1.0))
                                : ros::Time();
}

/// Maximum length of a frame's name, in bytes, so that a few names cannot fill the memory.
constexpr size_t kLongestName = 200;

inline Eigen::Vector3d toEigen(const geometry_msgs::Vector3& v) { return {v.x, v.y, v.z}; }

/// Unlike tf2::transformToEigen(), normalises the rotation.
inline Eigen::Isometry3d toIsometry(const geometry_msgs::Transform& transform) {
  const geometry_msgs::Quaternion& q = transform.rotation;
  return Eigen::Translation3d(toEigen(transform.translation)) *
         Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized();
}

/// `T` maps coordinates in `child` to `parent`.
inline geometry_msgs::TransformStamped makeTransform(const std::string& parent,
                                                     const std::string& child,
                                                     const Eigen::Isometry3d& T,
                                                     const ros::Time& stamp) {
  geometry_msgs::TransformStamped transform = tf2::eigenToTransform(T);
  transform.header.stamp = stamp;
  transform.header.frame_id = parent;
  transform.child_frame_id = child;
  return transform;
}

/// The sample in a message; none if the message has no acceleration or no stamp. In
/// sensor_msgs/Imu, -1 as the first element of a covariance marks a quantity that is not measured.
inline std::optional<InertialSample> sampleOf(const sensor_msgs::Imu& imu) {
  if (imu.linear_acceleration_covariance[0] == -1.0 || imu.header.stamp.isZero()) {
    return std::nullopt;
  }
  InertialSample sample{imu.header.stamp.toSec(), toEigen(imu.linear_acceleration), {}};
  if (imu.angular_velocity_covariance[0] != -1.0) {
    sample.turn_rad_s = toEigen(imu.angular_velocity);
  }
  return sample;
}

}  // namespace dtsdf
