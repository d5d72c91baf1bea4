/// How the triangles of a mesh hang together, counted from the triangles alone.
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
  size_t boundary_edges = 0;      ///< Sides with no triangle across.
  size_t crowded_edges = 0;       ///< Sides of more than two triangles.
  size_t inconsistent_edges = 0;  ///< Sides passed more often one way than the other, not boundary.
  size_t repeated_corners = 0;    ///< Triangles that name a vertex twice.
  size_t zero_areas = 0;          ///< Triangles whose corners lie on a line.
  size_t unused_vertices = 0;
  size_t coincident_vertices = 0;  ///< Vertices at exactly the position of another.

  /// No holes, every side between two triangles that agree on which side is free.
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
