#include <algorithm>
#include <cmath>
#include <limits>

#include "simulation/shapes.h"

namespace dtsdf {

namespace {

/// Range of the image coordinate of points within `radius` of (x, z), for one axis of a pinhole.
/// Widened by a pixel; the exact tangents are not needed, as each pixel is tested anyway.
void boundAxis(double x, double z, double radius, double f, double c, int size, int& begin,
               int& end) {
  const double near = z - radius, far = z + radius;  // near > 0
  const double low = x - radius, high = x + radius;
  const double first = low / (low < 0.0 ? near : far), last = high / (high < 0.0 ? far : near);
  const double limit = static_cast<double>(size);
  begin = static_cast<int>(std::clamp(std::floor(f * first + c), 0.0, limit));
  end = static_cast<int>(std::clamp(std::ceil(f * last + c) + 1.0, 0.0, limit));
}

/// The pixels that a shape can be seen in, from min() up to max().
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

/// What is seen in one pixel.
struct Hit {
  float depth_m = std::numeric_limits<float>::infinity();
  size_t shape = 0;
};

/// A direction with z = 1 in the optical frame: its parameter is the depth.
Eigen::Vector3d directionOf(const Intrinsics& K, int u, int v) {
  return {(u - static_cast<double>(K.cx)) / K.fx, (v - static_cast<double>(K.cy)) / K.fy, 1.0};
}

std::vector<Hit> findHits(const Scene& scene, const Intrinsics& K, int width, int height,
                          const Eigen::Isometry3d& T_W_C) {
  std::vector<Hit> hits(static_cast<size_t>(width) * static_cast<size_t>(height));
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
          if (z_m < nearest.depth_m) nearest = {z_m, number};
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
  for (const Hit& hit : findHits(scene, K, width, height, T_W_C)) {
    depth_m.push_back(std::isfinite(hit.depth_m) ? hit.depth_m : 0.0f);
  }
  return depth_m;
}

std::vector<Paint> renderPaint(const Scene& scene, const Intrinsics& K, int width, int height,
                               const Eigen::Isometry3d& T_W_C) {
  const std::vector<Hit> hits = findHits(scene, K, width, height, T_W_C);
  std::vector<Paint> pixels(hits.size(), Paint{0, 0, 0});
  for (size_t i = 0; i < hits.size(); ++i) {
    if (!std::isfinite(hits[i].depth_m)) continue;
    const int u = static_cast<int>(i % static_cast<size_t>(width));
    const int v = static_cast<int>(i / static_cast<size_t>(width));
    const Eigen::Vector3d p_W = T_W_C * (hits[i].depth_m * directionOf(K, u, v));
    pixels[i] = paintAt(scene, hits[i].shape, p_W);
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
