#include "evaluation/depth_registration.h"

#include <algorithm>
#include <cmath>

#include "evaluation/point_to_plane.h"

namespace dtsdf {

namespace {

using Eigen::Vector3d;

constexpr int kStride_px = 6;  // some 8000 points of an image of 640 x 480
constexpr double kFarthestShare = 0.05, kFarthest_m = 0.1;
/// At first that bound is so many times as wide: a map may lie farther off the recorded pose, most
/// of all where a wall is seen from close by.
constexpr double kFirstReach = 4.0;
constexpr size_t kFewestPoints = 50;

/// From where on a difference says nothing.
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
      // As a share of the depth, with which the noise of cameras grows.
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
