#include "evaluation/mesh_registration.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "evaluation/parallel.h"
#include "evaluation/point_to_plane.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr size_t kSamples = 50000, kFewestSamples = 50;
constexpr double kFirstReach_m = 0.4, kLastReach_m = 0.05;
constexpr double kStepsPerHalf = 4.0;

/// Samples and the planes of the triangles nearest to them, for those within reach.
std::vector<PointToPlane> nearestPlanes(const MeshScene& truth, const std::vector<Vector3d>& points,
                                        double reach_m) {
  std::vector<PointToPlane> pairs(points.size());
  forEachIndex(points.size(), [&](size_t i) {
    const ClosestPoint closest = truth.closestPoint(points[i].cast<float>());
    const Vector3d normal = truth.triangleNormal(closest.triangle).cast<double>();
    const Vector3d corner =
        truth.mesh().vertices[truth.mesh().triangles[closest.triangle][0]].cast<double>();
    pairs[i] = {points[i], normal, normal.dot(corner - points[i]),
                biweight(closest.distance_m, reach_m)};
  });
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                             [](const PointToPlane& pair) { return pair.weight <= 0.0; }),
              pairs.end());
  return pairs;
}

}  // namespace

MeshRegistration registerMesh(const MeshScene& truth, const TriangleMesh& mesh, int steps) {
  std::vector<Vector3d> points;
  Vector3d middle = Vector3d::Zero();
  for (const Eigen::Vector3f& p : sampleSurface(mesh, kSamples, 1).points) {
    points.push_back(p.cast<double>());
    middle += points.back() / static_cast<double>(kSamples);
  }
  MeshRegistration result;
  for (int i = 0; i < steps; ++i) {
    const double reach_m = std::max(kLastReach_m, kFirstReach_m * std::exp2(-i / kStepsPerHalf));
    const std::vector<PointToPlane> pairs = nearestPlanes(truth, points, reach_m);
    if (pairs.size() < kFewestSamples) return {};
    const Eigen::Isometry3d step = motionOf(pairs);
    for (Vector3d& p : points) p = step * p;
    result.motion = step * result.motion;
    result.points = pairs.size();
  }
  result.shift_m = (result.motion * middle - middle).norm();
  result.turn_rad = Eigen::AngleAxisd(result.motion.linear()).angle();
  return result;
}

void move(TriangleMesh& mesh, const Eigen::Isometry3d& motion) {
  for (Eigen::Vector3f& p : mesh.vertices) p = (motion * p.cast<double>()).cast<float>();
}

}  // namespace dtsdf
