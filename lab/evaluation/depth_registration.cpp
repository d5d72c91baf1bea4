#include "evaluation/depth_registration.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace dtsdf {

namespace {

using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr int kStride_px = 6;  // some 8000 points of an image of 640 x 480
constexpr double kFarthestShare = 0.05, kFarthest_m = 0.1;
/// At first that bound is so many times as wide: a map may lie farther off the recorded pose, most
/// of all where a wall is seen from close by.
constexpr double kFirstReach = 4.0;
constexpr size_t kFewestPoints = 50;

/// A measured point and the plane of the triangle that its ray hits.
struct PointToPlane {
  Vector3d p_W, normal_W;
  double distance_m;  ///< From the point to the plane, along the normal.
  double weight;
};

/// 1 where mesh and measurement agree, 0 where they are too far apart (Tukey's biweight).
double biweight(double difference_m, double depth_m, double reach) {
  const double ratio = difference_m / (reach * std::min(kFarthestShare * depth_m, kFarthest_m));
  const double rest = std::max(0.0, 1.0 - ratio * ratio);
  return rest * rest;
}

std::vector<PointToPlane> associate(const MeshScene& scene, const ViewCamera& camera,
                                    const std::vector<float>& depth_m,
                                    const Eigen::Isometry3d& T_W_C, double reach) {
  std::vector<PointToPlane> pairs;
  const Eigen::Vector3f eye_W = T_W_C.translation().cast<float>();
  for (int v = kStride_px / 2; v < camera.height; v += kStride_px) {
    for (int u = kStride_px / 2; u < camera.width; u += kStride_px) {
      const double z_m = static_cast<double>(depth_m[camera.pixelAt(u, v)]);
      if (z_m <= 0.0) continue;
      const Vector3d ray_W =
          T_W_C.linear() *
          rayOf(camera.intrinsics, static_cast<float>(u), static_cast<float>(v)).cast<double>();
      const auto hit = scene.intersect(eye_W, ray_W.cast<float>());
      if (!hit) continue;
      const double behind_m = static_cast<double>(hit->distance) - z_m;
      const double weight = biweight(behind_m, z_m, reach);
      if (weight <= 0.0) continue;
      const Vector3d normal_W = hit->normal.cast<double>();
      // As a share of the depth, with which the noise of cameras grows.
      pairs.push_back({T_W_C.translation() + z_m * ray_W, normal_W, behind_m * normal_W.dot(ray_W),
                       weight / (z_m * z_m)});
    }
  }
  return pairs;
}

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

/// The small motion that takes the points to their planes.
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

}  // namespace

Registration registerDepth(const MeshScene& scene, const ViewCamera& camera,
                           const std::vector<float>& depth_m, const Eigen::Isometry3d& T_W_C,
                           int steps) {
  Registration result{T_W_C};
  for (int i = 0; i < steps; ++i) {
    const double reach = std::max(1.0, std::ldexp(kFirstReach, -i));
    const std::vector<PointToPlane> pairs = associate(scene, camera, depth_m, result.T_W_C, reach);
    if (pairs.size() < kFewestPoints) return {T_W_C};
    result.T_W_C = motionOf(pairs) * result.T_W_C;
    result.points = pairs.size();
  }
  result.shift_m = (result.T_W_C.translation() - T_W_C.translation()).norm();
  result.turn_rad = Eigen::AngleAxisd(T_W_C.linear().transpose() * result.T_W_C.linear()).angle();
  return result;
}

}  // namespace dtsdf
