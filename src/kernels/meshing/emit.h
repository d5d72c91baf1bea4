/// Emits triangles as references to edges of the corner grid.
#pragma once

#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// Index of a unit's first edge. Added to the edge indices of the block's first unit, it gives the
/// edge indices of this unit.
DTSDF_HD int firstEdge(const Vec3i& unit) {
  return edgeNumber(cornerIndex(unit.x, unit.y, unit.z), 0, 0);
}

/// Index in the corner grid of edge e (0 to 11) of a unit; `index` is the unit's marching cubes
/// case.
DTSDF_HD int unitEdge(const Vec3i& unit, int e, uint8_t index) {
  return firstEdge(unit) + firstUnitEdge(e, index);
}

DTSDF_HD uint32_t countTriangles(const MeshTables& tables, const UnitIndices& indices) {
  uint32_t count = 0;
  for (int s = 0; s < kMaxSheets; ++s) count += tables.triangle_count[indices.sheet[s]];
  return count;
}

/// Calls visit(edge) for each corner of a unit's triangles, three per triangle, in canonical order.
template <class Visit>
DTSDF_HD void visitTriangleEdges(const MeshTables& tables, const UnitIndices& indices,
                                 const Vec3i& unit, const Visit& visit) {
  const int first_edge = firstEdge(unit);
  for (int s = 0; s < kMaxSheets; ++s) {
    const uint8_t index = indices.sheet[s];
    for (int k = 0; k < 3 * tables.triangle_count[index]; ++k) {
      visit(first_edge + tables.grid_edge[index][k]);
    }
  }
}

}  // namespace dtsdf
