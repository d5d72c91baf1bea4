/// Topology of a mesh, counted from its triangles alone.
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
  size_t boundary_edges = 0;      ///< Sides of a single triangle.
  size_t crowded_edges = 0;       ///< Sides of more than two triangles.
  size_t inconsistent_edges = 0;  ///< Sides traversed more often in one direction, not boundary.
  size_t repeated_corners = 0;    ///< Triangles that contain a vertex twice.
  size_t zero_areas = 0;          ///< Triangles whose corners are collinear.
  size_t unused_vertices = 0;
  size_t coincident_vertices = 0;  ///< Vertices at exactly the position of another.

  /// No holes, and each side joins two triangles that agree on the free side.
  bool isClosedManifold() const {
    return triangles > 0 && boundary_edges == 0 && crowded_edges == 0 && inconsistent_edges == 0;
  }
};

std::ostream& operator<<(std::ostream& out, const MeshTopology& topology);

/// Counts of sides only; vertices are numbers.
MeshTopology measureTopology(const std::vector<Triangle>& triangles);

/// All counts.
MeshTopology measureTopology(const Mesh& mesh);

}  // namespace dtsdf
