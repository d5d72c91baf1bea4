/// Triangles, the last step of the make stage: as references to the edges of the corner grid.
#pragma once

#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// Edge of the corner grid that is edge e (0 to 11) of a unit with a given index: the index tells
/// the facing.
DTSDF_HD int unitEdge(const Vec3i& unit, int e, uint8_t index) {
  const int lower = edgeLowerCorner(e);
  const int corner =
      cornerIndex(unit.x + (lower & 1), unit.y + (lower >> 1 & 1), unit.z + (lower >> 2 & 1));
  return edgeNumber(corner, e / 4, (index >> lower & 1) ? 0 : 1);
}

DTSDF_HD uint32_t countTriangles(const MeshTables& tables, const UnitIndices& indices) {
  uint32_t count = 0;
  for (int s = 0; s < kMaxSheets; ++s) count += tables.triangle_count[indices.sheet[s]];
  return count;
}

/// Calls visit(edge) for the corners of a unit's triangles, three each, in canonical order.
template <class Visit>
DTSDF_HD void visitTriangleEdges(const MeshTables& tables, const UnitIndices& indices,
                                 const Vec3i& unit, const Visit& visit) {
  for (int s = 0; s < kMaxSheets; ++s) {
    const uint8_t index = indices.sheet[s];
    for (int k = 0; k < 3 * tables.triangle_count[index]; ++k) {
      visit(unitEdge(unit, tables.triangle_edge[index][k], index));
    }
  }
}

}  // namespace dtsdf
