/// Counts the defects in the topology of a mesh.
#pragma once

#include <array>
#include <cstdint>
#include <ostream>
#include <vector>

#include "dtsdf_mapping/mesh.h"

namespace dtsdf {

using Triangle = std::array<uint32_t, 3>;

struct MeshTopology {
  size_t triangles = 0;
  size_t boundary_edges = 0;      ///< Edges that belong to only one triangle.
  size_t nonmanifold_edges = 0;   ///< Edges shared by more than two triangles.
  size_t inconsistent_edges = 0;  ///< Shared edges whose triangles are oriented inconsistently.
  size_t repeated_corners = 0;    ///< Triangles that contain a vertex twice.
  size_t zero_areas = 0;          ///< Triangles whose corners are collinear.
  size_t unused_vertices = 0;
  size_t coincident_vertices = 0;  ///< Vertices at exactly the position of another vertex.

  /// Whether the mesh has no holes and each edge joins two consistently oriented triangles.
  bool isClosedManifold() const {
    return triangles > 0 && boundary_edges == 0 && nonmanifold_edges == 0 &&
           inconsistent_edges == 0;
  }
};

std::ostream& operator<<(std::ostream& out, const MeshTopology& topology);

/// Computes only the counts that do not need positions: triangles, edges and repeated corners.
MeshTopology measureTopology(const std::vector<Triangle>& triangles);

MeshTopology measureTopology(const Mesh& mesh);

}  // namespace dtsdf
