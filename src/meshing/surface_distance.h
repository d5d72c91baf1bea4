/// Computes distances of points from a mesh.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

double squaredDistanceOfTriangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c);

/// A tree of bounding boxes over the triangles of a mesh. The vertices must outlive it and not
/// change.
class SurfaceTree {
 public:
  SurfaceTree(const std::vector<Vec3f>& vertices_m,
              const std::vector<std::array<uint32_t, 3>>& triangles);

  /// Distance of a point from the nearest triangle, or `limit_m` if none is nearer.
  double distance(const Vec3f& p, double limit_m) const;

  /// Index of the triangle to test first. A search sets it to the nearest triangle, if it finds
  /// one.
  using Hint = uint32_t;
  static constexpr Hint kNoHint = 0xffffffffu;

  /// Distance of a point from the nearest triangle whose normal has a cosine of at most
  /// `greatest_cosine` with the unit vector `direction`, or `limit_m` if none is nearer. Triangles
  /// without area do not count. The hint affects only the speed.
  double distance(const Vec3f& p, double limit_m, const Vec3f& direction, float greatest_cosine,
                  Hint& hint) const;

  /// The corners of a hint's triangle.
  const std::array<uint32_t, 3>& cornersOf(Hint hint) const { return triangles_[hint]; }

 private:
  /// A leaf's triangles, or an inner node's two children, begin at `first`.
  struct Node {
    Vec3f low, high;
    Vec3f min_normal, greatest_normal;  ///< Bounds of the triangles' normals, per component.
    uint32_t first;
    uint32_t triangles;  ///< 0 for an inner node.
  };

  using Triangle = std::array<uint32_t, 3>;

  /// A triangle and the sum of its corners, by which nodes are split.
  struct Item {
    Vec3f place;
    uint32_t triangle;
  };

  void split(std::vector<Item>& items, uint32_t node, uint32_t begin, uint32_t end,
             const std::vector<Triangle>& triangles);
  Node leaf(uint32_t begin, uint32_t end) const;
  template <class MayCount, class Counts>
  double search(const Vec3f& p, double limit_m, const MayCount& may_count, const Counts& counts,
                Hint& hint) const;

  const std::vector<Vec3f>& vertices_m_;
  std::vector<Triangle> triangles_;  ///< In the order of the leaves.
  std::vector<Node> nodes_;
};

}  // namespace dtsdf
