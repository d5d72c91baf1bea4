/// Finds the edges of a mesh that belong to only one triangle, where a surface ends.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "evaluation/triangle_mesh.h"

namespace dtsdf {

/// Indices of the two vertices, the smaller index first.
using MeshEdge = std::array<uint32_t, 2>;

/// Edges that belong to only one triangle. Vertices at the same position are not merged.
std::vector<MeshEdge> boundaryEdges(const TriangleMesh& mesh);

/// The border of a surface, with vertices at the same position merged.
struct MeshBorder {
  size_t edges = 0;        ///< Edges that belong to only one triangle.
  size_t small_holes = 0;  ///< Closed loops in connected sets of 3 to 16 of these edges.
};
MeshBorder measureBorder(const TriangleMesh& mesh);

}  // namespace dtsdf
