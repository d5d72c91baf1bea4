/// An independent description of the unit cube, for checking the mesh tables.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <set>
#include <utility>
#include <vector>

#include "kernels/meshing/mesh_tables.h"

namespace dtsdf {

/// A directed side of a triangle; its ends lie on two edges of the cube.
using Segment = std::pair<int, int>;

inline Eigen::Vector3d cornerPoint(int corner) {
  return Eigen::Vector3d(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
}

/// The two corners of every edge. Edges are ordered by axis, then by their first corner.
inline std::array<std::pair<int, int>, 12> cubeEdges() {
  std::array<std::pair<int, int>, 12> edges;
  size_t n = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int corner = 0; corner < 8; ++corner) {
      if (!(corner >> axis & 1)) edges[n++] = {corner, corner + (1 << axis)};
    }
  }
  return edges;
}

inline bool isBehind(int index, int corner) { return index >> corner & 1; }

inline Eigen::Vector3d edgeMiddle(int edge) {
  const auto [a, b] = cubeEdges()[static_cast<size_t>(edge)];
  return 0.5 * (cornerPoint(a) + cornerPoint(b));
}

inline std::set<int> crossedEdges(int index) {
  std::set<int> crossed;
  const auto edges = cubeEdges();
  for (int e = 0; e < 12; ++e) {
    const auto [a, b] = edges[static_cast<size_t>(e)];
    if (isBehind(index, a) != isBehind(index, b)) crossed.insert(e);
  }
  return crossed;
}

inline std::vector<std::array<int, 3>> trianglesOf(int index) {
  std::vector<std::array<int, 3>> triangles;
  for (int t = 0; t < kMeshTables.triangle_count[index]; ++t) {
    const uint8_t* e = &kMeshTables.triangle_edge[index][3 * t];
    triangles.push_back({e[0], e[1], e[2]});
  }
  return triangles;
}

/// Rim of the surface of a marching-cubes case: the sides of triangles that no other triangle
/// traverses in reverse.
inline std::set<Segment> rimOf(int index) {
  std::set<Segment> sides;
  for (const auto& t : trianglesOf(index)) {
    for (size_t i = 0; i < 3; ++i) sides.insert({t[i], t[(i + 1) % 3]});
  }
  std::set<Segment> rim;
  for (const Segment& side : sides) {
    if (sides.count({side.second, side.first}) == 0) rim.insert(side);
  }
  return rim;
}

/// Outward normals of the cube's faces on which a segment lies.
inline std::vector<Eigen::Vector3d> facesOf(const Segment& segment) {
  const Eigen::Vector3d a = edgeMiddle(segment.first), b = edgeMiddle(segment.second);
  std::vector<Eigen::Vector3d> normals;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {0.0, 1.0}) {
      if (a[axis] == side && b[axis] == side) {
        normals.push_back((2.0 * side - 1.0) * Eigen::Vector3d::Unit(axis));
      }
    }
  }
  return normals;
}

}  // namespace dtsdf
