#include "evaluation/point_to_plane.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace dtsdf {

namespace {

using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Solves A x = b, with no part in x along which A hardly changes anything.
Vector6d solveWhereHeld(const Matrix6d& A, const Vector6d& b) {
  constexpr double kLeastShare = 1e-3;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> axes(A);
  const double largest = axes.eigenvalues()[5];
  Vector6d x = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    const double value = axes.eigenvalues()[i];
    if (value <= kLeastShare * largest) continue;
    x += axes.eigenvectors().col(i).dot(b) / value * axes.eigenvectors().col(i);
  }
  return x;
}

}  // namespace

Eigen::Isometry3d motionOf(const std::vector<PointToPlane>& pairs) {
  Vector3d centre_W = Vector3d::Zero();
  for (const PointToPlane& pair : pairs) centre_W += pair.p_W;
  centre_W /= static_cast<double>(pairs.size());
  double squares = 0.0;
  for (const PointToPlane& pair : pairs) squares += (pair.p_W - centre_W).squaredNorm();
  // Turns are measured by the way that they move a point at this distance, as shifts are.
  const double radius_m = std::max(1e-6, std::sqrt(squares / static_cast<double>(pairs.size())));
  Matrix6d A = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  for (const PointToPlane& pair : pairs) {
    Vector6d row;
    row << (pair.p_W - centre_W).cross(pair.normal_W) / radius_m, pair.normal_W;
    A += pair.weight * row * row.transpose();
    b += pair.weight * pair.distance_m * row;
  }
  const Vector6d x = solveWhereHeld(A, b);
  const Vector3d turn = x.head<3>() / radius_m, shift = x.tail<3>();
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.translate(centre_W + shift);
  if (turn.norm() > 0.0) motion.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  motion.translate(-centre_W);
  return motion;
}

double biweight(double difference, double reach) {
  const double ratio = difference / reach;
  const double rest = std::max(0.0, 1.0 - ratio * ratio);
  return rest * rest;
}

}  // namespace dtsdf
