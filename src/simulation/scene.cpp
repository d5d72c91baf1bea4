#include "simulation/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace dtsdf {
namespace {

/// A ray in W; its direction need not be a unit vector.
using Ray = Eigen::ParametrizedLine<double, 3>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Range of a ray's parameter in which the ray is inside a solid; empty by default.
using Interval = Eigen::AlignedBox<double, 1>;

const Interval kAll(-kInfinity, kInfinity);

/// Interval of s in which origin + s * direction lies in [low, high] along one axis.
Interval slab(double origin, double direction, double low, double high) {
  if (direction == 0.0) return origin >= low && origin <= high ? kAll : Interval();
  const double a = (low - origin) / direction, b = (high - origin) / direction;
  return Interval(std::min(a, b), std::max(a, b));
}

Interval insideBox(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                   const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Interval inside = kAll;
  for (int axis = 0; axis < 3; ++axis) {
    inside.clamp(slab(origin[axis], direction[axis], low[axis], high[axis]));
  }
  return inside;
}

/// Interval of s in which a s^2 + 2 b s + c <= 0, for a >= 0.
Interval insideQuadric(double a, double b, double c) {
  if (a == 0.0) return c <= 0.0 ? kAll : Interval();
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0) return Interval();
  const double root = std::sqrt(discriminant);
  return Interval((-b - root) / a, (-b + root) / a);
}

/// Parameter at which a ray enters a convex solid, given the range in which the ray is inside.
/// Infinity if the ray misses the solid or starts inside it.
double entry(const Interval& inside) {
  return inside.isEmpty() || inside.min().x() <= 0.0 ? kInfinity : inside.min().x();
}

/// Signed distance to a box, given abs(p) - half size along each axis.
double boxDistance(const Eigen::Vector3d& excess) {
  return excess.cwiseMax(0.0).norm() + std::min(excess.maxCoeff(), 0.0);
}

double intersect(const Plane& plane, const Ray& ray) {
  const double approach = ray.direction().dot(plane.normal_W);
  if (approach >= 0.0) return kInfinity;
  const double s = (plane.point_W - ray.origin()).dot(plane.normal_W) / approach;
  return s > 0.0 ? s : kInfinity;
}

double intersect(const Sphere& sphere, const Ray& ray) {
  const Eigen::Vector3d offset = ray.origin() - sphere.centre_W;
  return entry(insideQuadric(ray.direction().squaredNorm(), offset.dot(ray.direction()),
                             offset.squaredNorm() - sphere.radius_m * sphere.radius_m));
}

double intersect(const Box& box, const Ray& ray) {
  const Eigen::Matrix3d R_B_W = box.T_W_B.linear().transpose();
  return entry(insideBox(R_B_W * (ray.origin() - box.T_W_B.translation()), R_B_W * ray.direction(),
                         -box.half_size_m, box.half_size_m));
}

double intersect(const Rod& rod, const Ray& ray) {
  const Eigen::Vector3d span = rod.end_W - rod.start_W;
  const double length = span.norm();
  const Eigen::Vector3d axis = span / length;
  const Eigen::Vector3d offset = ray.origin() - rod.start_W;
  const double along_origin = offset.dot(axis), along_direction = ray.direction().dot(axis);
  const Eigen::Vector3d across_origin = offset - along_origin * axis;
  const Eigen::Vector3d across_direction = ray.direction() - along_direction * axis;
  Interval inside = slab(along_origin, along_direction, 0.0, length);
  inside.clamp(insideQuadric(across_direction.squaredNorm(), across_origin.dot(across_direction),
                             across_origin.squaredNorm() - rod.radius_m * rod.radius_m));
  return entry(inside);
}

double intersect(const Room& room, const Ray& ray) {
  const Interval inside = insideBox(ray.origin(), ray.direction(), room.min(), room.max());
  // Everything outside the room is solid, so a ray that starts there hits nothing.
  const bool within = !inside.isEmpty() && inside.min().x() <= 0.0 && inside.max().x() > 0.0;
  return within ? inside.max().x() : kInfinity;
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
  const Eigen::Vector3d centre = 0.5 * (room.min() + room.max());
  const Eigen::Vector3d half_size = 0.5 * (room.max() - room.min());
  return -boxDistance((p_W - centre).cwiseAbs() - half_size);
}

std::optional<Sphere> boundingSphere(const Shape& shape) {
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    return *sphere;
  }
  if (const auto* box = std::get_if<Box>(&shape)) {
    return Sphere{box->T_W_B.translation(), box->half_size_m.norm()};
  }
  if (const auto* rod = std::get_if<Rod>(&shape)) {
    return Sphere{0.5 * (rod->start_W + rod->end_W),
                  std::hypot(0.5 * (rod->end_W - rod->start_W).norm(), rod->radius_m)};
  }
  return std::nullopt;
}

}  // namespace

Box makeBox(const Eigen::Vector3d& centre_W, const Eigen::Vector3d& size_m, double yaw_rad) {
  Eigen::Isometry3d T_W_B = Eigen::Isometry3d::Identity();
  T_W_B.translation() = centre_W;
  T_W_B.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return {T_W_B, 0.5 * size_m};
}

double Scene::intersect(const Eigen::Vector3d& origin_W, const Eigen::Vector3d& direction_W) const {
  double nearest = kInfinity;
  for (const Shape& shape : shapes_) {
    const auto hit = [&](const auto& s) { return dtsdf::intersect(s, Ray(origin_W, direction_W)); };
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

namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

/// A rod that stands on the floor.
Rod makePost(double x, double y, double height_m, double radius_m) {
  return {Vector3d(x, y, 0.0), Vector3d(x, y, height_m), radius_m};
}

}  // namespace

Scene makeRoomScene() {
  Scene scene;
  scene.add(Room{Vector3d(-3.0, -2.5, 0.0), Vector3d(3.0, 2.5, 2.6)});
  // A 30 mm thick wall, visible from both sides.
  scene.add(makeBox(Vector3d(0.0, 0.0, 0.85), Vector3d(1.8, 0.03, 1.7)));
  // Plates 10, 20 and 40 mm thick on the floor. Only the first is aligned with the grid.
  scene.add(makeBox(Vector3d(-0.6, 0.55, 0.4), Vector3d(0.5, 0.01, 0.8)));
  scene.add(makeBox(Vector3d(0.5, 0.55, 0.45), Vector3d(0.5, 0.02, 0.9), 0.6));
  scene.add(makeBox(Vector3d(0.1, -0.55, 0.45), Vector3d(0.5, 0.04, 0.9), -0.35));
  // A table: a thin plate on four rods.
  scene.add(makeBox(Vector3d(-0.7, -0.6, 0.61), Vector3d(0.6, 0.5, 0.02), 0.2));
  for (const double dx : {-0.22, 0.22}) {
    for (const double dy : {-0.17, 0.17}) scene.add(makePost(-0.7 + dx, -0.6 + dy, 0.6, 0.015));
  }
  scene.add(makePost(1.2, 0.25, 1.6, 0.01));
  scene.add(makePost(1.2, -0.35, 1.6, 0.03));
  scene.add(Rod{Vector3d(1.2, -0.32, 1.3), Vector3d(1.2, 0.24, 1.3), 0.02});
  // A ball, and furniture along the walls.
  scene.add(Sphere{Vector3d(0.75, -0.6, 0.2), 0.2});
  scene.add(makeBox(Vector3d(-2.7, 0.8, 0.5), Vector3d(0.6, 1.2, 1.0)));
  scene.add(makeBox(Vector3d(0.8, 2.3, 1.2), Vector3d(1.2, 0.4, 0.02)));
  scene.add(makeBox(Vector3d(2.65, -1.5, 0.35), Vector3d(0.5, 0.5, 0.7), 0.4));
  return scene;
}

std::vector<Sphere> roomBalls(int count, double time_s) {
  constexpr double kLap_s = 10.0, kRadius_m = 0.15;
  std::vector<Sphere> balls;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * kPi * (time_s / kLap_s + static_cast<double>(i) / count);
    const Vector3d centre_W(1.2 * std::cos(angle), 0.9 * std::sin(angle),
                            1.2 + 0.3 * std::sin(3.0 * angle + i));
    balls.push_back({centre_W, kRadius_m});
  }
  return balls;
}

Eigen::Isometry3d roomCameraPose(double time_s, double lap_s) {
  const double angle = 2.0 * kPi * time_s / lap_s;
  const Vector3d eye_W(2.15 * std::cos(angle), 1.75 * std::sin(angle),
                       1.35 + 0.35 * std::sin(2.0 * angle));
  // The target moves around the centre of the room, so that the corners come into view too.
  const Vector3d target_W(0.5 * std::sin(3.0 * angle), 0.4 * std::cos(2.0 * angle),
                          0.75 + 0.25 * std::sin(3.0 * angle + 1.0));
  return lookAt(eye_W, target_W, Vector3d::UnitZ());
}

namespace {

/// Number of faces of a box, and their colours: -x, +x, -y, +y, -z, +z.
constexpr int kFaces = 6;
constexpr Paint kFacePaint[kFaces] = {{200, 60, 50},  {60, 90, 210},   {70, 170, 80},
                                      {225, 170, 60}, {150, 140, 130}, {230, 230, 225}};
constexpr Paint kRoundPaint{120, 70, 160};
constexpr double kSquare_m = 0.25;
constexpr double kDarkShade = 0.7;

/// Index of the box face on which a point lies. This face is perpendicular to the axis along which
/// the point is farthest out.
int faceOf(const Eigen::Vector3d& p, const Eigen::Vector3d& half_size) {
  int axis = 0;
  (p.cwiseAbs() - half_size).maxCoeff(&axis);
  return 2 * axis + (p[axis] > 0.0 ? 1 : 0);
}

Paint basePaint(const Shape& shape, const Eigen::Vector3d& p_W) {
  if (const auto* box = std::get_if<Box>(&shape)) {
    return kFacePaint[faceOf(box->T_W_B.inverse() * p_W, box->half_size_m)];
  }
  const auto* room = std::get_if<Room>(&shape);
  if (room == nullptr) return kRoundPaint;
  const Eigen::Vector3d half = 0.5 * (room->max() - room->min());
  return kFacePaint[faceOf(p_W - (room->min() + half), half)];
}

/// Whether a point lies in a dark cube of a 3D chequerboard. The cubes are shifted to keep their
/// faces off surfaces, many of which lie at multiples of 0.25 m.
bool isDark(const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d square = ((p_W / kSquare_m).array() + 0.37).floor();
  return static_cast<long>(square.sum()) % 2 != 0;
}

}  // namespace

Paint paintAt(const Scene& scene, size_t shape, const Eigen::Vector3d& p_W) {
  Paint paint = basePaint(scene.shapes()[shape], p_W);
  if (!isDark(p_W)) return paint;
  for (uint8_t& channel : paint) {
    channel = static_cast<uint8_t>(std::lround(kDarkShade * channel));
  }
  return paint;
}

namespace {

/// Range of one image coordinate that contains the points within `radius` of (x, z), for a pinhole
/// camera. May be larger than necessary, since each pixel is tested anyway.
void boundAxis(double x, double z, double radius, double f, double c, int size, int& begin,
               int& end) {
  const double near = z - radius, far = z + radius;  // near > 0
  const double low = x - radius, high = x + radius;
  const double first = low / (low < 0.0 ? near : far), last = high / (high < 0.0 ? far : near);
  const double limit = static_cast<double>(size);
  begin = static_cast<int>(std::clamp(std::floor(f * first + c), 0.0, limit));
  end = static_cast<int>(std::clamp(std::ceil(f * last + c) + 1.0, 0.0, limit));
}

/// The pixels in which a shape may be visible, from min() up to but excluding max().
Eigen::AlignedBox2i projectedRect(const Shape& shape, const Intrinsics& K, int width, int height,
                                  const Eigen::Isometry3d& T_C_W) {
  Eigen::AlignedBox2i rect(Eigen::Vector2i(0, 0), Eigen::Vector2i(width, height));
  const std::optional<Sphere> bound = boundingSphere(shape);
  if (!bound) return rect;
  const Eigen::Vector3d p = T_C_W * bound->centre_W;
  const double radius_m = bound->radius_m;
  if (p.z() + radius_m <= 0.0) return {};
  if (p.z() - radius_m <= 0.0) return rect;
  boundAxis(p.x(), p.z(), radius_m, K.fx, K.cx, width, rect.min().x(), rect.max().x());
  boundAxis(p.y(), p.z(), radius_m, K.fy, K.cy, height, rect.min().y(), rect.max().y());
  return rect;
}

/// The surface visible in a pixel: its depth, and the index of its shape.
using Hit = std::pair<float, size_t>;

/// The direction of a pixel in the optical frame, with z = 1, so that a ray's parameter is depth.
Eigen::Vector3d directionOf(const Intrinsics& K, int u, int v) {
  return {(u - static_cast<double>(K.cx)) / K.fx, (v - static_cast<double>(K.cy)) / K.fy, 1.0};
}

std::vector<Hit> findHits(const Scene& scene, const Intrinsics& K, int width, int height,
                          const Eigen::Isometry3d& T_W_C) {
  constexpr float kNothing = std::numeric_limits<float>::infinity();
  std::vector<Hit> hits(static_cast<size_t>(width) * static_cast<size_t>(height), {kNothing, 0});
  const Eigen::Isometry3d T_C_W = T_W_C.inverse();
  const Eigen::Matrix3d& R_W_C = T_W_C.linear();
  for (size_t number = 0; number < scene.shapes().size(); ++number) {
    const Shape& shape = scene.shapes()[number];
    const Eigen::AlignedBox2i rect = projectedRect(shape, K, width, height, T_C_W);
    const auto draw = [&](const auto& s) {
      for (int v = rect.min().y(); v < rect.max().y(); ++v) {
        for (int u = rect.min().x(); u < rect.max().x(); ++u) {
          const Ray ray(T_W_C.translation(), R_W_C * directionOf(K, u, v));
          const auto z_m = static_cast<float>(intersect(s, ray));
          Hit& nearest =
              hits[static_cast<size_t>(v) * static_cast<size_t>(width) + static_cast<size_t>(u)];
          if (z_m < nearest.first) nearest = {z_m, number};
        }
      }
    };
    std::visit(draw, shape);
  }
  return hits;
}

}  // namespace

DepthFrame depthFrameOf(const std::vector<float>& depth_m, const Intrinsics& intrinsics, int width,
                        int height, const Eigen::Isometry3d& T_W_C) {
  DepthFrame frame;
  frame.data = depth_m.data();
  frame.width = width;
  frame.height = height;
  frame.row_bytes = static_cast<size_t>(width) * sizeof(float);
  frame.encoding = DepthEncoding::kFloat32;
  frame.unit_m = 1.0f;
  frame.intrinsics = intrinsics;
  frame.T_W_C = T_W_C;
  return frame;
}

std::vector<float> renderDepth(const Scene& scene, const Intrinsics& K, int width, int height,
                               const Eigen::Isometry3d& T_W_C) {
  std::vector<float> depth_m;
  for (const auto& [hit_m, shape] : findHits(scene, K, width, height, T_W_C)) {
    depth_m.push_back(std::isfinite(hit_m) ? hit_m : 0.0f);
  }
  return depth_m;
}

std::vector<Paint> renderPaint(const Scene& scene, const Intrinsics& K, int width, int height,
                               const Eigen::Isometry3d& T_W_C) {
  const std::vector<Hit> hits = findHits(scene, K, width, height, T_W_C);
  std::vector<Paint> pixels(hits.size(), Paint{0, 0, 0});
  for (size_t i = 0; i < hits.size(); ++i) {
    const auto& [depth_m, shape] = hits[i];
    if (!std::isfinite(depth_m)) continue;
    const int u = static_cast<int>(i % static_cast<size_t>(width));
    const int v = static_cast<int>(i / static_cast<size_t>(width));
    const Eigen::Vector3d p_W = T_W_C * (depth_m * directionOf(K, u, v));
    pixels[i] = paintAt(scene, shape, p_W);
  }
  return pixels;
}

Eigen::Isometry3d lookAt(const Eigen::Vector3d& eye_W, const Eigen::Vector3d& target_W,
                         const Eigen::Vector3d& up_W) {
  const Eigen::Vector3d forward = (target_W - eye_W).normalized();
  const Eigen::Vector3d right = forward.cross(up_W).normalized();
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  T_W_C.linear().col(0) = right;
  T_W_C.linear().col(1) = forward.cross(right);
  T_W_C.linear().col(2) = forward;
  T_W_C.translation() = eye_W;
  return T_W_C;
}

}  // namespace dtsdf
