/// Edges of a mesh that belong to one triangle only, where a surface ends.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "evaluation/triangle_mesh.h"

namespace dtsdf {

/// Two vertices, the one with the smaller number first.
using MeshEdge = std::array<uint32_t, 2>;

/// Those of one triangle, by vertex index: nothing is welded.
std::vector<MeshEdge> boundaryEdges(const TriangleMesh& mesh);

/// Where a surface ends, with vertices at the same position taken as one.
struct MeshBorder {
  size_t edges = 0;        ///< Edges of one triangle only.
  size_t small_holes = 0;  ///< Closed loops in connected sets of 3 to 16 such edges.
};
MeshBorder measureBorder(const TriangleMesh& mesh);

}  // namespace dtsdf
