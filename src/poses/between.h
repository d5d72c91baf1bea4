/// Poses between two others.
#pragma once

#include <Eigen/Geometry>

namespace dtsdf {

/// The pose at a share of the way from `a` to `b`: positions linearly, rotations by slerp.
inline Eigen::Isometry3d between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b,
                                 double share) {
  const Eigen::Quaterniond from(a.linear()), to(b.linear());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = from.slerp(share, to).normalized().toRotationMatrix();
  pose.translation() = (1.0 - share) * a.translation() + share * b.translation();
  return pose;
}

}  // namespace dtsdf
