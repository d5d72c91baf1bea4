#include "ros/output/found_pose.h"

#include <Eigen/Eigenvalues>

namespace dtsdf {
namespace {

/// Of the prior's variance, beyond which an axis is free.
constexpr double kFreeShare = 0.25;

/// Variances of what is not known, which filters still can work with.
constexpr double kUnknown_m2 = 1e3, kUnknown_rad2 = 10.0;

Eigen::Matrix3d sumOfSquares(const std::vector<Eigen::Vector3d>& axes) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& axis : axes) sum += axis * axis.transpose();
  return sum;
}

Eigen::Matrix3d crossProductBy(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return matrix;
}

}  // namespace

std::vector<Eigen::Vector3d> freeAxes(const Eigen::Matrix3d& covariance, double sigma) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  std::vector<Eigen::Vector3d> axes;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (solver.eigenvalues()[i] <= kFreeShare * sigma * sigma) continue;
    axes.emplace_back(solver.eigenvectors().col(i));
  }
  return axes;
}

Matrix6d odometryCovariance(const Alignment& alignment, const PoseParams& params) {
  Matrix6d covariance = alignment.covariance;
  // What was not aligned is where it was given, such as the first image.
  const bool adds_up =
      params.mode == PoseMode::kTrack && alignment.status == AlignmentStatus::kAligned;
  if (!adds_up) return covariance;
  const Eigen::Matrix3d shifts = covariance.topLeftCorner<3, 3>();
  const Eigen::Matrix3d turns = covariance.bottomRightCorner<3, 3>();
  covariance.topLeftCorner<3, 3>() += kUnknown_m2 * sumOfSquares(freeAxes(shifts, params.sigma_m));
  covariance.bottomRightCorner<3, 3>() +=
      kUnknown_rad2 * sumOfSquares(freeAxes(turns, params.sigma_rad));
  return covariance;
}

Matrix6d movedCovariance(const Matrix6d& covariance, const Eigen::Matrix3d& R_M_W,
                         const Eigen::Vector3d& offset_M) {
  Matrix6d jacobian = Matrix6d::Zero();
  jacobian.topLeftCorner<3, 3>() = R_M_W;
  jacobian.topRightCorner<3, 3>() = -crossProductBy(offset_M) * R_M_W;
  jacobian.bottomRightCorner<3, 3>() = R_M_W;
  return jacobian * covariance * jacobian.transpose();
}

}  // namespace dtsdf
