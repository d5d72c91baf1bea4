#include "meshing/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/core/vec.h"

namespace dtsdf {
namespace {

constexpr uint32_t kLeafTriangles = 4;

double squaredDistanceOfBox(const Vec3f& p, const Vec3f& low, const Vec3f& high) {
  const auto outside = [](float at, float from, float to) {
    return static_cast<double>(maximum(maximum(from - at, at - to), 0.0f));
  };
  const double x = outside(p.x, low.x, high.x), y = outside(p.y, low.y, high.y),
               z = outside(p.z, low.z, high.z);
  return x * x + y * y + z * z;
}

Vec3f least(const Vec3f& a, const Vec3f& b) {
  return {minimum(a.x, b.x), minimum(a.y, b.y), minimum(a.z, b.z)};
}

Vec3f greatest(const Vec3f& a, const Vec3f& b) {
  return {maximum(a.x, b.x), maximum(a.y, b.y), maximum(a.z, b.z)};
}

double squaredLength(const Vec3f& a) { return static_cast<double>(dot(a, a)); }

double squaredDistanceOfSegment(const Vec3f& p, const Vec3f& a, const Vec3f& b) {
  const Vec3f along = b - a;
  const float length = dot(along, along);
  const float t = length > 0.0f ? dot(p - a, along) / length : 0.0f;
  return squaredLength(p - (a + minimum(maximum(t, 0.0f), 1.0f) * along));
}

}  // namespace

// Within the triangle's prism the distance of its plane, else that of the nearest side.
double squaredDistanceOfTriangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const Vec3f n = cross(b - a, c - a);
  const float area = dot(n, n);
  const auto is_inside = [&](const Vec3f& from, const Vec3f& to) {
    return dot(cross(to - from, p - from), n) >= 0.0f;
  };
  if (area > 0.0f && is_inside(a, b) && is_inside(b, c) && is_inside(c, a)) {
    const double height = static_cast<double>(dot(p - a, n));
    return height * height / static_cast<double>(area);
  }
  return std::min({squaredDistanceOfSegment(p, a, b), squaredDistanceOfSegment(p, b, c),
                   squaredDistanceOfSegment(p, c, a)});
}

SurfaceTree::SurfaceTree(const std::vector<Vec3f>& vertices_m,
                         const std::vector<std::array<uint32_t, 3>>& triangles)
    : vertices_m_(vertices_m), triangles_(triangles), order_(triangles.size()) {
  for (size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<uint32_t>(i);
  nodes_.reserve(order_.size());
  nodes_.emplace_back();
  split(0, 0, static_cast<uint32_t>(order_.size()));
}

/// Halves at the median of the triangles' middles, along the longest side of the box.
void SurfaceTree::split(uint32_t node, uint32_t begin, uint32_t end) {
  constexpr float kFar = 3e38f;
  const Vec3f far{kFar, kFar, kFar}, near{-kFar, -kFar, -kFar};
  Node box{far, near, far, near, begin, end - begin};
  for (uint32_t i = begin; i < end; ++i) {
    for (const uint32_t v : triangles_[order_[i]]) {
      box.low = least(box.low, vertices_m_[v]);
      box.high = greatest(box.high, vertices_m_[v]);
    }
  }
  if (end - begin <= kLeafTriangles) {
    for (uint32_t i = begin; i < end; ++i) boundNormal(box, triangles_[order_[i]]);
    nodes_[node] = box;
    return;
  }
  const Vec3f size = box.high - box.low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  const auto place = [&](uint32_t triangle) {
    const auto& t = triangles_[triangle];
    return component(vertices_m_[t[0]], axis) + component(vertices_m_[t[1]], axis) +
           component(vertices_m_[t[2]], axis);
  };
  const uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](uint32_t a, uint32_t b) {
                     const float of_a = place(a), of_b = place(b);
                     return of_a != of_b ? of_a < of_b : a < b;
                   });
  const auto children = static_cast<uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  split(children, begin, middle);
  split(children + 1, middle, end);
  const Node &a = nodes_[children], &b = nodes_[children + 1];
  nodes_[node] = {box.low, box.high, least(a.least_normal, b.least_normal),
                  greatest(a.greatest_normal, b.greatest_normal), children, 0};
}

void SurfaceTree::boundNormal(Node& node, const std::array<uint32_t, 3>& t) const {
  const Vec3f &a = vertices_m_[t[0]], &b = vertices_m_[t[1]], &c = vertices_m_[t[2]];
  const Vec3f n = cross(b - a, c - a);
  const float length = norm(n);
  if (length == 0.0f) return;  // faces nothing
  const Vec3f normal = (1.0f / length) * n;
  node.least_normal = least(node.least_normal, normal);
  node.greatest_normal = greatest(node.greatest_normal, normal);
}

template <class MayCount, class Counts>
double SurfaceTree::search(const Vec3f& p, double limit_m, const MayCount& may_count,
                           const Counts& counts) const {
  double nearest = limit_m * limit_m;
  // Halving leaves 32 levels at most, and each adds one node to those that wait.
  std::array<std::pair<double, uint32_t>, 64> waiting;
  size_t count = 0;
  const auto put = [&](uint32_t node) {
    if (!may_count(nodes_[node])) return;
    const double distance = squaredDistanceOfBox(p, nodes_[node].low, nodes_[node].high);
    if (distance < nearest) waiting[count++] = {distance, node};
  };
  put(0);
  while (count > 0) {
    const auto [distance, at] = waiting[--count];
    if (distance >= nearest) continue;
    const Node& node = nodes_[at];
    for (uint32_t i = 0; i < node.triangles; ++i) {
      const auto& t = triangles_[order_[node.first + i]];
      const Vec3f &a = vertices_m_[t[0]], &b = vertices_m_[t[1]], &c = vertices_m_[t[2]];
      const double of_triangle = squaredDistanceOfTriangle(p, a, b, c);
      if (of_triangle < nearest && counts(a, b, c)) nearest = of_triangle;
    }
    if (node.triangles > 0) continue;
    put(node.first);
    put(node.first + 1);
    if (count > 1 && waiting[count - 1].first > waiting[count - 2].first) {
      std::swap(waiting[count - 1], waiting[count - 2]);  // the nearer one next
    }
  }
  return std::sqrt(nearest);
}

double SurfaceTree::distance(const Vec3f& p, double limit_m) const {
  return search(
      p, limit_m, [](const Node&) { return true; },
      [](const Vec3f&, const Vec3f&, const Vec3f&) { return true; });
}

double SurfaceTree::distance(const Vec3f& p, double limit_m, const Vec3f& direction,
                             const FacingLimits& facing) const {
  // Of a box of normals a corner turns least from the direction, and the one opposite most.
  const auto mayCount = [&](const Node& node) {
    const Vec3f &low = node.least_normal, &high = node.greatest_normal;
    const Vec3f most{direction.x > 0.0f ? high.x : low.x, direction.y > 0.0f ? high.y : low.y,
                     direction.z > 0.0f ? high.z : low.z};
    const Vec3f most_away{direction.x > 0.0f ? low.x : high.x, direction.y > 0.0f ? low.y : high.y,
                          direction.z > 0.0f ? low.z : high.z};
    constexpr float kRounding = 1e-5f;
    return dot(most, direction) >= facing.least_cosine - kRounding &&
           dot(most_away, direction) <= facing.greatest_cosine + kRounding;
  };
  return search(p, limit_m, mayCount, [&](const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    const Vec3f n = cross(b - a, c - a);
    const float length = norm(n), along = dot(n, direction);
    return length > 0.0f && along >= facing.least_cosine * length &&
           along <= facing.greatest_cosine * length;
  });
}

}  // namespace dtsdf
