#include "evaluation/moving_object.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "evaluation/mesh_scene.h"

namespace dtsdf {

namespace {

constexpr uint64_t kSampleSeed = 1;

/// An interval of a line's parameter.
struct Interval {
  double begin, end;

  bool isEmpty() const { return begin > end; }
};

/// Where origin + t * direction lies between -half and half on every axis.
Interval withinBox(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                   const Eigen::Vector3d& half, Interval within) {
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) {
      if (std::abs(origin[axis]) > half[axis]) return {1.0, 0.0};
      continue;
    }
    const double a = (-half[axis] - origin[axis]) / direction[axis];
    const double b = (half[axis] - origin[axis]) / direction[axis];
    within.begin = std::max(within.begin, std::min(a, b));
    within.end = std::min(within.end, std::max(a, b));
  }
  return within;
}

/// Where origin + t * direction lies in the unit sphere.
Interval withinUnitBall(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const double a = direction.squaredNorm(), b = origin.dot(direction);
  const double discriminant = b * b - a * (origin.squaredNorm() - 1.0);
  if (discriminant < 0.0) return {1.0, 0.0};
  const double root = std::sqrt(discriminant);
  return {(-b - root) / a, (-b + root) / a};
}

}  // namespace

MovingObject::Shape objectShapeFromName(const std::string& name) {
  if (name == "box") return MovingObject::Shape::kBox;
  if (name == "ball") return MovingObject::Shape::kBall;
  throw std::invalid_argument("unknown shape '" + name + "'; use box or ball");
}

std::optional<double> intersect(const MovingObject& object, const Eigen::Vector3d& centre_W,
                                const Eigen::Vector3d& origin_W,
                                const Eigen::Vector3d& direction_W) {
  // In units of half the object's size it is a cube or a sphere.
  const Eigen::Vector3d half = 0.5 * object.size_m;
  const Eigen::Vector3d origin = (origin_W - centre_W).cwiseQuotient(half);
  const Eigen::Vector3d direction = direction_W.cwiseQuotient(half);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const Interval inside = object.shape == MovingObject::Shape::kBox
                              ? withinBox(origin, direction, Eigen::Vector3d::Ones(), {-kFar, kFar})
                              : withinUnitBall(origin, direction);
  if (inside.isEmpty() || inside.begin <= 0.0) return std::nullopt;
  return inside.begin;
}

bool sweeps(const MovingObject& object, const Eigen::Vector3d& p_W, double margin_m) {
  const Eigen::Vector3d half = 0.5 * object.size_m + Eigen::Vector3d::Constant(margin_m);
  // Seen from the object's centre the point moves the other way.
  return !withinBox(p_W - object.from_W, object.from_W - object.to_W, half, {0.0, 1.0}).isEmpty();
}

size_t composite(const MovingObject& object, const Eigen::Vector3d& centre_W,
                 const ViewCamera& camera, const Eigen::Isometry3d& T_W_C,
                 std::vector<float>& depth_m) {
  size_t shown = 0, pixel = 0;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u, ++pixel) {
      // A direction with z = 1 in the optical frame: its parameter at the hit is the depth.
      const Eigen::Vector3f ray =
          rayOf(camera.intrinsics, static_cast<float>(u), static_cast<float>(v));
      const auto z_m =
          intersect(object, centre_W, T_W_C.translation(), T_W_C.linear() * ray.cast<double>());
      if (!z_m || (depth_m[pixel] > 0.0f && static_cast<double>(depth_m[pixel]) <= *z_m)) continue;
      depth_m[pixel] = static_cast<float>(*z_m);
      ++shown;
    }
  }
  return shown;
}

Trail findTrail(const TriangleMesh& mesh, const TriangleMesh& reference, const MovingObject& object,
                const TrailRule& rule) {
  const std::vector<double> areas = triangleAreas(mesh);
  const SurfaceSamples surface = sampleSurface(mesh, rule.samples, kSampleSeed);
  const MeshScene scene(reference);
  Trail trail;
  trail.sample_m2 =
      std::accumulate(areas.begin(), areas.end(), 0.0) / static_cast<double>(rule.samples);
  for (const Eigen::Vector3f& p_W : surface.points) {
    if (!sweeps(object, p_W.cast<double>(), rule.margin_m)) continue;
    ++trail.swept;
    if (scene.closestPoint(p_W).distance_m > rule.distance_m) trail.points.push_back(p_W);
  }
  return trail;
}

bool seesThrough(const std::vector<float>& depth_m, const ViewCamera& camera,
                 const Eigen::Isometry3d& T_W_C, const Eigen::Vector3d& p_W, double distance_m) {
  const Eigen::Vector3d p_C = T_W_C.inverse() * p_W;
  if (p_C.z() <= 0.0) return false;
  const Intrinsics& K = camera.intrinsics;
  const double u = std::round(static_cast<double>(K.fx) * p_C.x() / p_C.z() + K.cx);
  const double v = std::round(static_cast<double>(K.fy) * p_C.y() / p_C.z() + K.cy);
  if (u < 0.0 || v < 0.0 || u >= camera.width || v >= camera.height) return false;
  const float z_m = depth_m[camera.pixelAt(static_cast<int>(u), static_cast<int>(v))];
  return static_cast<double>(z_m) > p_C.z() + distance_m;
}

std::vector<size_t> countSeenThrough(const std::vector<Eigen::Vector3f>& points, const Views& views,
                                     const std::vector<size_t>& chosen, double distance_m) {
  std::vector<size_t> counts(points.size(), 0);
  for (const size_t view : chosen) {
    const std::vector<float> depth_m = readTumDepth(views.depth_paths[view], views.camera);
    for (size_t i = 0; i < points.size(); ++i) {
      if (seesThrough(depth_m, views.camera, views.poses_W_C[view], points[i].cast<double>(),
                      distance_m)) {
        ++counts[i];
      }
    }
  }
  return counts;
}

}  // namespace dtsdf
