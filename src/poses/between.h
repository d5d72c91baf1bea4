/// The step between two poses, interpolation between them, and the fraction of an image that an
/// alignment places on surfaces of the map.
#pragma once

#include <Eigen/Geometry>

#include "dtsdf_mapping/alignment.h"

namespace dtsdf {

/// Errors larger than this many standard deviations are not considered random: in a normal
/// distribution, only 3 in 1000 are larger.
constexpr double kMaxDeviations = 3.0;

/// Fraction of the image's points that lie on surfaces of the map; 0 unless the image was aligned.
inline double explainedBy(const Alignment& alignment) {
  return alignment.status == AlignmentStatus::kAligned
             ? alignment.matched_share * alignment.inlier_share
             : 0.0;
}

/// The step from one pose to another: a shift in metres, then a small rotation in radians, both
/// along the axes of the poses' reference frame.
inline Eigen::Matrix<double, 6, 1> stepBetween(const Eigen::Isometry3d& from,
                                               const Eigen::Isometry3d& to) {
  const Eigen::AngleAxisd turn(to.linear() * from.linear().transpose());
  Eigen::Matrix<double, 6, 1> step;
  step << to.translation() - from.translation(), turn.angle() * turn.axis();
  return step;
}

/// The pose at a fraction of the way from `a` to `b`: positions are interpolated linearly,
/// rotations by slerp.
inline Eigen::Isometry3d between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b,
                                 double share) {
  const Eigen::Quaterniond from(a.linear()), to(b.linear());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = from.slerp(share, to).normalized().toRotationMatrix();
  pose.translation() = (1.0 - share) * a.translation() + share * b.translation();
  return pose;
}

}  // namespace dtsdf
