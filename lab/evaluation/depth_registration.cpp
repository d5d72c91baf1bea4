#include "evaluation/depth_registration.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace dtsdf {

namespace {

using Eigen::Vector3d;

constexpr int kStride_px = 6;  // about 8500 points in a 640 x 480 image
constexpr double kFarthestShare = 0.05, kFarthest_m = 0.1;
/// Factor by which the limit (reachAt()) is larger in the first step, since an image at its
/// recorded pose may be far from the mesh.
constexpr double kFirstReach = 4.0;
constexpr size_t kFewestPoints = 50;

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// A measured point and the plane in which it should lie.
struct PointToPlane {
  Vector3d p_W, normal_W;
  double distance_m;  ///< From the point to the plane, along the normal.
  double weight;
};

/// Gauss-Newton step over all points, excluding motion in directions that the planes hardly
/// constrain.
/// @pre `pairs` is not empty.
Eigen::Isometry3d motionOf(const std::vector<PointToPlane>& pairs) {
  Vector3d centre_W = Vector3d::Zero();
  for (const PointToPlane& pair : pairs) centre_W += pair.p_W;
  centre_W /= static_cast<double>(pairs.size());
  double squares = 0.0;
  for (const PointToPlane& pair : pairs) squares += (pair.p_W - centre_W).squaredNorm();
  // Rotations are expressed by how far they move a point at this distance, which makes them
  // comparable to translations.
  const double radius_m = std::max(1e-6, std::sqrt(squares / static_cast<double>(pairs.size())));
  Matrix6d A = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  for (const PointToPlane& pair : pairs) {
    Vector6d row;
    row << (pair.p_W - centre_W).cross(pair.normal_W) / radius_m, pair.normal_W;
    A += pair.weight * row * row.transpose();
    b += pair.weight * pair.distance_m * row;
  }
  Eigen::CompleteOrthogonalDecomposition<Matrix6d> held;
  held.setThreshold(1e-3);
  const Vector6d x = held.compute(A).solve(b);
  const Vector3d turn = x.head<3>() / radius_m, shift = x.tail<3>();
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.translate(centre_W + shift);
  if (turn.norm() > 0.0) motion.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  motion.translate(-centre_W);
  return motion;
}

/// Tukey's biweight: 1 if the difference is 0, falling to 0 at `reach` and beyond.
double biweight(double difference, double reach) {
  const double ratio = difference / reach;
  const double rest = std::max(0.0, 1.0 - ratio * ratio);
  return rest * rest;
}

/// Limit in metres, scaled by `reach`, at and above which differences are ignored.
double reachAt(double depth_m, double reach) {
  return reach * std::min(kFarthestShare * depth_m, kFarthest_m);
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
      const double weight = biweight(behind_m, reachAt(z_m, reach));
      if (weight <= 0.0) continue;
      const Vector3d normal_W = hit->normal.cast<double>();
      // Weighted by the inverse square of the depth, since camera noise grows with depth.
      pairs.push_back({T_W_C.translation() + z_m * ray_W, normal_W, behind_m * normal_W.dot(ray_W),
                       weight / (z_m * z_m)});
    }
  }
  return pairs;
}

}  // namespace

Eigen::Isometry3d registerDepth(const MeshScene& scene, const ViewCamera& camera,
                                const std::vector<float>& depth_m, const Eigen::Isometry3d& T_W_C,
                                int steps) {
  Eigen::Isometry3d best_W_C = T_W_C;
  for (int i = 0; i < steps; ++i) {
    const double reach = std::max(1.0, std::ldexp(kFirstReach, -i));
    const std::vector<PointToPlane> pairs = associate(scene, camera, depth_m, best_W_C, reach);
    if (pairs.size() < kFewestPoints) return T_W_C;
    best_W_C = motionOf(pairs) * best_W_C;
  }
  return best_W_C;
}

}  // namespace dtsdf
