#include "meshing/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/core/vec.h"

namespace dtsdf {
namespace {

constexpr uint32_t kLeafTriangles = 8;

double squaredDistanceOfBox(const Vec3f& p, const Vec3f& low, const Vec3f& high) {
  const auto outside = [](float at, float from, float to) {
    return static_cast<double>(maximum(maximum(from - at, at - to), 0.0f));
  };
  const double x = outside(p.x, low.x, high.x), y = outside(p.y, low.y, high.y),
               z = outside(p.z, low.z, high.z);
  return x * x + y * y + z * z;
}

double squaredLength(const Vec3f& a) { return static_cast<double>(dot(a, a)); }

double squaredDistanceOfSegment(const Vec3f& p, const Vec3f& a, const Vec3f& b) {
  const Vec3f along = b - a;
  const float length = dot(along, along);
  const float t = length > 0.0f ? dot(p - a, along) / length : 0.0f;
  return squaredLength(p - (a + minimum(maximum(t, 0.0f), 1.0f) * along));
}

}  // namespace

// Measures the distance from the triangle's plane if p projects into the triangle, else from its
// nearest side.
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
    : vertices_m_(vertices_m), triangles_(triangles.size()) {
  std::vector<Item> items;
  items.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    items.push_back({vertices_m[t[0]] + vertices_m[t[1]] + vertices_m[t[2]],
                     static_cast<uint32_t>(items.size())});
  }
  nodes_.reserve(triangles.size());
  nodes_.emplace_back();
  split(items, 0, 0, static_cast<uint32_t>(items.size()), triangles);
}

/// Splits at the median of the triangles' centroids, along the axis of their largest extent.
void SurfaceTree::split(std::vector<Item>& items, uint32_t node, uint32_t begin, uint32_t end,
                        const std::vector<Triangle>& triangles) {
  if (end - begin <= kLeafTriangles) {
    for (uint32_t i = begin; i < end; ++i) triangles_[i] = triangles[items[i].triangle];
    nodes_[node] = leaf(begin, end);
    return;
  }
  Vec3f low = items[begin].place, high = low;
  for (uint32_t i = begin; i < end; ++i) {
    low = minOf(low, items[i].place);
    high = maxOf(high, items[i].place);
  }
  const Vec3f size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  const uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(items.begin() + begin, items.begin() + middle, items.begin() + end,
                   [axis](const Item& a, const Item& b) {
                     const float of_a = component(a.place, axis), of_b = component(b.place, axis);
                     return of_a != of_b ? of_a < of_b : a.triangle < b.triangle;
                   });
  const auto children = static_cast<uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  split(items, children, begin, middle, triangles);
  split(items, children + 1, middle, end, triangles);
  const Node &a = nodes_[children], &b = nodes_[children + 1];
  nodes_[node] = {minOf(a.low, b.low),
                  maxOf(a.high, b.high),
                  minOf(a.min_normal, b.min_normal),
                  maxOf(a.greatest_normal, b.greatest_normal),
                  children,
                  0};
}

SurfaceTree::Node SurfaceTree::leaf(uint32_t begin, uint32_t end) const {
  constexpr float kFar = 3e38f;
  const Vec3f far{kFar, kFar, kFar}, near{-kFar, -kFar, -kFar};
  Node node{far, near, far, near, begin, end - begin};
  for (uint32_t i = begin; i < end; ++i) {
    const Triangle& t = triangles_[i];
    const Vec3f &a = vertices_m_[t[0]], &b = vertices_m_[t[1]], &c = vertices_m_[t[2]];
    node.low = minOf(node.low, minOf(a, minOf(b, c)));
    node.high = maxOf(node.high, maxOf(a, maxOf(b, c)));
    const Vec3f n = cross(b - a, c - a);
    const float length = norm(n);
    if (length == 0.0f) continue;  // it has no normal
    const Vec3f normal = (1.0f / length) * n;
    node.min_normal = minOf(node.min_normal, normal);
    node.greatest_normal = maxOf(node.greatest_normal, normal);
  }
  return node;
}

template <class MayCount, class Counts>
double SurfaceTree::search(const Vec3f& p, double limit_m, const MayCount& may_count,
                           const Counts& counts, Hint& hint) const {
  double nearest = limit_m * limit_m;
  const auto test = [&](uint32_t triangle) {
    const Triangle& t = triangles_[triangle];
    const Vec3f &a = vertices_m_[t[0]], &b = vertices_m_[t[1]], &c = vertices_m_[t[2]];
    if (!counts(a, b, c)) return;
    const double of_triangle = squaredDistanceOfTriangle(p, a, b, c);
    if (!(of_triangle < nearest)) return;
    nearest = of_triangle;
    hint = triangle;
  };
  if (hint < triangles_.size()) test(hint);
  // Halving gives at most 32 levels, and each of them adds one waiting node.
  std::array<std::pair<double, uint32_t>, 64> waiting;
  size_t count = 0;
  const auto put = [&](uint32_t node) {
    const double distance = squaredDistanceOfBox(p, nodes_[node].low, nodes_[node].high);
    if (distance < nearest && may_count(nodes_[node])) waiting[count++] = {distance, node};
  };
  put(0);
  while (count > 0) {
    const auto [distance, at] = waiting[--count];
    if (distance >= nearest) continue;
    const Node& node = nodes_[at];
    for (uint32_t i = 0; i < node.triangles; ++i) test(node.first + i);
    if (node.triangles > 0) continue;
    put(node.first);
    put(node.first + 1);
    if (count > 1 && waiting[count - 1].first > waiting[count - 2].first) {
      std::swap(waiting[count - 1], waiting[count - 2]);  // the nearer node comes first
    }
  }
  return std::sqrt(nearest);
}

double SurfaceTree::distance(const Vec3f& p, double limit_m) const {
  Hint hint = kNoHint;
  return search(
      p, limit_m, [](const Node&) { return true; },
      [](const Vec3f&, const Vec3f&, const Vec3f&) { return true; }, hint);
}

double SurfaceTree::distance(const Vec3f& p, double limit_m, const Vec3f& direction,
                             float greatest_cosine, Hint& hint) const {
  // Tests the corner of the box of normals that is farthest from the direction.
  const auto mayCount = [&](const Node& node) {
    const Vec3f &low = node.min_normal, &high = node.greatest_normal;
    const Vec3f max_away{direction.x > 0.0f ? low.x : high.x, direction.y > 0.0f ? low.y : high.y,
                         direction.z > 0.0f ? low.z : high.z};
    constexpr float kRounding = 1e-5f;
    return dot(max_away, direction) <= greatest_cosine + kRounding;
  };
  const auto counts = [&](const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    const Vec3f n = cross(b - a, c - a);
    const float length = norm(n);
    return length > 0.0f && dot(n, direction) <= greatest_cosine * length;
  };
  return search(p, limit_m, mayCount, counts, hint);
}

}  // namespace dtsdf
