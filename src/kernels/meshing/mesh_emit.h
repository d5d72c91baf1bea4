/// Triangles of a mesh unit as references to the edges of its block's lattice.
#pragma once

#include "kernels/core/grid.h"
#include "kernels/meshing/mesh_unit.h"

namespace dtsdf {

/// The corners of a block's 8 x 8 x 8 units form a lattice of 9 x 9 x 9.
constexpr int kLatticeSide = kBlockSide + 1;
constexpr int kLatticeCorners = kLatticeSide * kLatticeSide * kLatticeSide;
constexpr int kLatticeEdges = kLatticeCorners * 3 * 2;

DTSDF_HD int latticeIndex(int x, int y, int z) {
  return x + kLatticeSide * (y + kLatticeSide * z);
}

DTSDF_HD Vec3i latticeCorner(int index) {
  return {index % kLatticeSide, index / kLatticeSide % kLatticeSide,
          index / (kLatticeSide * kLatticeSide)};
}

/// BlockVertex::edge of a lattice corner, axis and facing; and back.
DTSDF_HD int latticeEdge(int lattice_index, int axis, int facing) {
  return (lattice_index * 3 + axis) * 2 + facing;
}
DTSDF_HD int edgeCorner(int edge) { return edge / 6; }
DTSDF_HD int edgeAxis(int edge) { return edge / 2 % 3; }
DTSDF_HD int edgeFacing(int edge) { return edge & 1; }

/// Lattice edge of edge e (0 to 11) of a unit for a given index of the unit: the index tells the
/// facing.
DTSDF_HD int unitEdge(const Vec3i& unit, int e, uint8_t index) {
  const int lower = edgeLowerCorner(e);
  const int corner = latticeIndex(unit.x + (lower & 1), unit.y + (lower >> 1 & 1),
                                  unit.z + (lower >> 2 & 1));
  return latticeEdge(corner, e / 4, (index >> lower & 1) ? 0 : 1);
}

/// Position of an edge's vertex in voxels, relative to the block's first voxel.
DTSDF_HD Vec3f vertexPosition(int edge, float offset) {
  const Vec3i corner = latticeCorner(edgeCorner(edge));
  const int axis = edgeAxis(edge);
  Vec3f p = toFloat(corner);
  if (axis == 0) p.x += offset;
  if (axis == 1) p.y += offset;
  if (axis == 2) p.z += offset;
  return p;
}

}  // namespace dtsdf
