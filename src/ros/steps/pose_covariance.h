/// Covariances of aligned poses, for odometry.
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <vector>

#include "dtsdf_mapping/alignment.h"
#include "dtsdf_mapping/params/pose_params.h"

namespace dtsdf {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Axes along or about which an image hardly constrains its pose, because the standard deviation
/// exceeds half of the prior's, `sigma`. `covariance` is of either the position or the rotation.
inline std::vector<Eigen::Vector3d> freeAxes(const Eigen::Matrix3d& covariance, double sigma) {
  constexpr double kFreeShare = 0.25;  // fraction of the prior's variance
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  std::vector<Eigen::Vector3d> axes;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (solver.eigenvalues()[i] <= kFreeShare * sigma * sigma) continue;
    axes.emplace_back(solver.eigenvectors().col(i));
  }
  return axes;
}

/// Covariance of a pose in the map. With poses/mode track, errors along free axes (see freeAxes())
/// add up from image to image, so a large variance along these axes is added. The covariance of an
/// image that was not aligned, such as the first one, is returned unchanged.
inline Matrix6d odometryCovariance(const Alignment& alignment, const PoseParams& params) {
  // Variances of unknown quantities: large, but not too large for filters.
  constexpr double kUnknown_m2 = 1e3, kUnknown_rad2 = 10.0;
  Matrix6d covariance = alignment.covariance;
  if (params.mode != PoseMode::kTrack || alignment.status != AlignmentStatus::kAligned) {
    return covariance;
  }
  const auto add = [&](Eigen::Index corner, double sigma, double unknown) {
    const Eigen::Matrix3d part = alignment.covariance.block<3, 3>(corner, corner);
    for (const Eigen::Vector3d& axis : freeAxes(part, sigma)) {
      covariance.block<3, 3>(corner, corner) += unknown * axis * axis.transpose();
    }
  };
  add(0, params.sigma_m, kUnknown_m2);
  add(3, params.sigma_rad, kUnknown_rad2);
  return covariance;
}

/// Covariance of the pose of frame B in M, computed from that of C's pose in W. B is rigidly
/// attached to C; `offset_M` is the vector from C to B, in M.
inline Matrix6d movedCovariance(const Matrix6d& covariance, const Eigen::Matrix3d& R_M_W,
                                const Eigen::Vector3d& offset_M) {
  Eigen::Matrix3d cross;
  cross << 0.0, -offset_M.z(), offset_M.y(), offset_M.z(), 0.0, -offset_M.x(), -offset_M.y(),
      offset_M.x(), 0.0;
  Matrix6d jacobian = Matrix6d::Zero();
  jacobian.topLeftCorner<3, 3>() = jacobian.bottomRightCorner<3, 3>() = R_M_W;
  jacobian.topRightCorner<3, 3>() = -cross * R_M_W;
  return jacobian * covariance * jacobian.transpose();
}

}  // namespace dtsdf
