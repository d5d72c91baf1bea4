#include "simulation/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulation/shapes.h"

namespace dtsdf {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Interval of a ray's parameter; empty where enter > exit.
struct Interval {
  double enter = -kInfinity, exit = kInfinity;

  void clip(const Interval& other) {
    enter = std::max(enter, other.enter);
    exit = std::min(exit, other.exit);
  }
  bool empty() const { return !(enter <= exit); }
};

constexpr Interval kEmpty{kInfinity, -kInfinity};

/// Where origin + s * direction lies in [low, high] along one axis.
Interval slab(double origin, double direction, double low, double high) {
  if (direction == 0.0) return origin >= low && origin <= high ? Interval{} : kEmpty;
  const double a = (low - origin) / direction, b = (high - origin) / direction;
  return {std::min(a, b), std::max(a, b)};
}

Interval insideBox(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                   const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Interval inside;
  for (int axis = 0; axis < 3; ++axis) {
    inside.clip(slab(origin[axis], direction[axis], low[axis], high[axis]));
  }
  return inside;
}

/// Where a s^2 + 2 b s + c <= 0, for a >= 0.
Interval insideQuadric(double a, double b, double c) {
  if (a == 0.0) return c <= 0.0 ? Interval{} : kEmpty;
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0) return kEmpty;
  const double root = std::sqrt(discriminant);
  return {(-b - root) / a, (-b + root) / a};
}

/// A convex solid is entered where the ray's interval begins; from within nothing is seen.
double entry(const Interval& inside) {
  return inside.empty() || inside.enter <= 0.0 ? kInfinity : inside.enter;
}

/// Distance to a box given by |p| - half size per axis.
double boxDistance(const Eigen::Vector3d& excess) {
  return excess.cwiseMax(0.0).norm() + std::min(excess.maxCoeff(), 0.0);
}

}  // namespace

double intersect(const Plane& plane, const Ray& ray) {
  const double approach = ray.direction.dot(plane.normal_W);
  if (approach >= 0.0) return kInfinity;
  const double s = (plane.point_W - ray.origin).dot(plane.normal_W) / approach;
  return s > 0.0 ? s : kInfinity;
}

double intersect(const Sphere& sphere, const Ray& ray) {
  const Eigen::Vector3d offset = ray.origin - sphere.centre_W;
  return entry(insideQuadric(ray.direction.squaredNorm(), offset.dot(ray.direction),
                             offset.squaredNorm() - sphere.radius_m * sphere.radius_m));
}

double intersect(const Box& box, const Ray& ray) {
  const Eigen::Matrix3d R_B_W = box.T_W_B.linear().transpose();
  return entry(insideBox(R_B_W * (ray.origin - box.T_W_B.translation()), R_B_W * ray.direction,
                         -box.half_size_m, box.half_size_m));
}

double intersect(const Rod& rod, const Ray& ray) {
  const Eigen::Vector3d span = rod.end_W - rod.start_W;
  const double length = span.norm();
  const Eigen::Vector3d axis = span / length;
  const Eigen::Vector3d offset = ray.origin - rod.start_W;
  const double along_origin = offset.dot(axis), along_direction = ray.direction.dot(axis);
  const Eigen::Vector3d across_origin = offset - along_origin * axis;
  const Eigen::Vector3d across_direction = ray.direction - along_direction * axis;
  Interval inside = slab(along_origin, along_direction, 0.0, length);
  inside.clip(insideQuadric(across_direction.squaredNorm(), across_origin.dot(across_direction),
                            across_origin.squaredNorm() - rod.radius_m * rod.radius_m));
  return entry(inside);
}

double intersect(const Room& room, const Ray& ray) {
  const Interval inside = insideBox(ray.origin, ray.direction, room.min_W, room.max_W);
  // Seen from outside, the walls are entered at once: nothing is there to be measured.
  const bool within = !inside.empty() && inside.enter <= 0.0 && inside.exit > 0.0;
  return within ? inside.exit : kInfinity;
}

double signedDistance(const Plane& plane, const Eigen::Vector3d& p_W) {
  return (p_W - plane.point_W).dot(plane.normal_W);
}

double signedDistance(const Sphere& sphere, const Eigen::Vector3d& p_W) {
  return (p_W - sphere.centre_W).norm() - sphere.radius_m;
}

double signedDistance(const Box& box, const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d p_B = box.T_W_B.linear().transpose() * (p_W - box.T_W_B.translation());
  return boxDistance(p_B.cwiseAbs() - box.half_size_m);
}

double signedDistance(const Rod& rod, const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d span = rod.end_W - rod.start_W;
  const double length = span.norm();
  const Eigen::Vector3d offset = p_W - 0.5 * (rod.start_W + rod.end_W);
  const double along = offset.dot(span) / length;
  const double across = (offset - along / length * span).norm();
  const double excess_along = std::abs(along) - 0.5 * length;
  const double excess_across = across - rod.radius_m;
  return std::hypot(std::max(excess_along, 0.0), std::max(excess_across, 0.0)) +
         std::min(std::max(excess_along, excess_across), 0.0);
}

double signedDistance(const Room& room, const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d centre = 0.5 * (room.min_W + room.max_W);
  const Eigen::Vector3d half_size = 0.5 * (room.max_W - room.min_W);
  return -boxDistance((p_W - centre).cwiseAbs() - half_size);
}

std::optional<BoundingSphere> boundingSphere(const Shape& shape) {
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    return BoundingSphere{sphere->centre_W, sphere->radius_m};
  }
  if (const auto* box = std::get_if<Box>(&shape)) {
    return BoundingSphere{box->T_W_B.translation(), box->half_size_m.norm()};
  }
  if (const auto* rod = std::get_if<Rod>(&shape)) {
    return BoundingSphere{0.5 * (rod->start_W + rod->end_W),
                          std::hypot(0.5 * (rod->end_W - rod->start_W).norm(), rod->radius_m)};
  }
  return std::nullopt;
}

Box makeBox(const Eigen::Vector3d& centre_W, const Eigen::Vector3d& size_m, double yaw_rad) {
  Eigen::Isometry3d T_W_B = Eigen::Isometry3d::Identity();
  T_W_B.translation() = centre_W;
  T_W_B.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return {T_W_B, 0.5 * size_m};
}

double Scene::intersect(const Eigen::Vector3d& origin_W, const Eigen::Vector3d& direction_W) const {
  double nearest = kInfinity;
  for (const Shape& shape : shapes_) {
    const auto hit = [&](const auto& s) { return dtsdf::intersect(s, Ray{origin_W, direction_W}); };
    nearest = std::min(nearest, std::visit(hit, shape));
  }
  return nearest;
}

double Scene::signedDistance(const Eigen::Vector3d& p_W) const {
  double nearest = kInfinity;
  for (const Shape& shape : shapes_) {
    const auto distance = [&](const auto& s) { return dtsdf::signedDistance(s, p_W); };
    nearest = std::min(nearest, std::visit(distance, shape));
  }
  return nearest;
}

double Scene::distanceToSurface(const Eigen::Vector3d& p_W) const {
  return std::abs(signedDistance(p_W));
}

}  // namespace dtsdf
