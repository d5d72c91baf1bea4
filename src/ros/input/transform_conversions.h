/// Between the transforms of ROS and ours.
#pragma once

#include <geometry_msgs/TransformStamped.h>

#include <Eigen/Geometry>
#include <string>

namespace dtsdf {

inline Eigen::Isometry3d toIsometry(const geometry_msgs::Transform& transform) {
  const geometry_msgs::Quaternion& q = transform.rotation;
  const geometry_msgs::Vector3& t = transform.translation;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  T.translation() << t.x, t.y, t.z;
  return T;
}

inline geometry_msgs::Transform toTransform(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  geometry_msgs::Transform transform;
  transform.rotation.w = q.w();
  transform.rotation.x = q.x();
  transform.rotation.y = q.y();
  transform.rotation.z = q.z();
  transform.translation.x = T.translation().x();
  transform.translation.y = T.translation().y();
  transform.translation.z = T.translation().z();
  return transform;
}

/// `T` maps coordinates in `child` to `parent`.
inline geometry_msgs::TransformStamped makeTransform(const std::string& parent,
                                                     const std::string& child,
                                                     const Eigen::Isometry3d& T,
                                                     const ros::Time& stamp) {
  geometry_msgs::TransformStamped transform;
  transform.header.stamp = stamp;
  transform.header.frame_id = parent;
  transform.child_frame_id = child;
  transform.transform = toTransform(T);
  return transform;
}

}  // namespace dtsdf
