/// How far points are from a mesh.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

/// Which triangles count, by how far their normals turn from a direction.
struct FacingLimits {
  float least_cosine, greatest_cosine;
};

double squaredDistanceOfTriangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c);

/// A tree of boxes over the triangles of a mesh, which outlives it and does not change.
class SurfaceTree {
 public:
  SurfaceTree(const std::vector<Vec3f>& vertices_m,
              const std::vector<std::array<uint32_t, 3>>& triangles);

  /// Distance of a point from the nearest triangle, or `limit_m` if none is nearer.
  double distance(const Vec3f& p, double limit_m) const;

  /// The same for triangles whose normals have such cosines with `direction`, a unit vector; those
  /// without area do not count.
  double distance(const Vec3f& p, double limit_m, const Vec3f& direction,
                  const FacingLimits& facing) const;

 private:
  /// A leaf has triangles from `first` on, an inner node its children there.
  struct Node {
    Vec3f low, high;
    Vec3f least_normal, greatest_normal;  ///< Of the triangles, by components.
    uint32_t first;
    uint32_t triangles;  ///< 0: an inner node.
  };

  void split(uint32_t node, uint32_t begin, uint32_t end);
  void boundNormal(Node& node, const std::array<uint32_t, 3>& triangle) const;
  template <class MayCount, class Counts>
  double search(const Vec3f& p, double limit_m, const MayCount& may_count,
                const Counts& counts) const;

  const std::vector<Vec3f>& vertices_m_;
  const std::vector<std::array<uint32_t, 3>>& triangles_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace dtsdf
