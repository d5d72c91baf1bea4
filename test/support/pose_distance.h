/// Distance and angle between two poses.
#pragma once

#include <Eigen/Geometry>

namespace dtsdf {

inline double shiftBetween_m(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}

inline double turnBetween_rad(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

}  // namespace dtsdf
