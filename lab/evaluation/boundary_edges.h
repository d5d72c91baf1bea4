/// Edges of a mesh that belong to one triangle only, and why: whether it ends where nothing more
/// was to be seen.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "evaluation/triangle_mesh.h"

namespace dtsdf {

/// Two vertices, the one with the smaller number first.
using MeshEdge = std::array<uint32_t, 2>;

/// Edges by vertex index: nothing is welded.
struct MeshEdges {
  std::vector<MeshEdge> boundary;  ///< Of one triangle.
  size_t non_manifold = 0;         ///< Of three triangles or more.
};
MeshEdges findEdges(const TriangleMesh& mesh);

/// Where a surface ends, with vertices at the same position taken as one.
struct MeshBorder {
  size_t edges = 0;        ///< Of one triangle.
  size_t small_holes = 0;  ///< Closed loops in connected sets of 3 to 16 such edges.
};
MeshBorder measureBorder(const TriangleMesh& mesh);

/// Median length of the sides of its triangles; 0 for a mesh without any.
float medianEdgeLength(const TriangleMesh& mesh);

/// Those of the edges whose middle is no farther than `reach_m` from some of the points.
size_t countBeside(const TriangleMesh& mesh, const std::vector<MeshEdge>& edges,
                   const std::vector<Eigen::Vector3f>& points, float reach_m);

}  // namespace dtsdf
