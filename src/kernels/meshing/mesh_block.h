/// How the mesh units of a block draw on the blocks around it, and which blocks a change reaches.
#pragma once

#include "kernels/meshing/mesh_emit.h"

namespace dtsdf {

/// {-1, 0}^3: the blocks whose units have a corner in a block, itself included.
constexpr int kUnitReach = 8;
DTSDF_HD Vec3i unitReachOffset(int n) { return {-(n & 1), -(n >> 1 & 1), -(n >> 2 & 1)}; }

/// {0, 1}^3: the blocks that the corners of a block's units lie in; 0 is the block itself.
constexpr int kLatticeBlocks = 8;
DTSDF_HD Vec3i latticeBlockOffset(int n) { return {n & 1, n >> 1 & 1, n >> 2 & 1}; }

/// Where the sample of a lattice corner lies: in which of the lattice's blocks, at which voxel.
struct LatticeSource {
  int block, voxel;
};

DTSDF_HD LatticeSource latticeSource(int lattice_index) {
  constexpr int kMask = kBlockSide - 1;
  const Vec3i c = latticeCorner(lattice_index);
  return {(c.x >> kBlockSideLog2) | (c.y >> kBlockSideLog2) << 1 | (c.z >> kBlockSideLog2) << 2,
          voxelIndex(c.x & kMask, c.y & kMask, c.z & kMask)};
}

/// A block and its face neighbours: the blocks whose units are regularised against a block's.
constexpr int kRegularisationReach = 7;
DTSDF_HD Vec3i regularisationOffset(int n) {
  return n == 0 ? Vec3i{0, 0, 0} : faceOffset(n - 1);
}

/// Where the indices of a unit lie that is in a block or across one of its faces: n as in
/// regularisationOffset(n), and the unit's number in that block.
struct UnitSource {
  int block, unit;
};

DTSDF_HD UnitSource unitSource(const Vec3i& unit) {
  constexpr int kMask = kBlockSide - 1;
  int block = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int32_t x = component(unit, axis);
    if (x < 0) block = 1 + 2 * axis;
    if (x >= kBlockSide) block = 2 + 2 * axis;
  }
  return {block, voxelIndex(unit.x & kMask, unit.y & kMask, unit.z & kMask)};
}

/// A unit's indices after regularisation. `at(unit)` gives the indices before it, in the block and
/// across its faces.
template <class At>
DTSDF_HD UnitIndices settleUnit(const At& at, const Vec3i& unit) {
  const UnitIndices own = at(unit);
  if (own.sheet[0] == 0) return own;
  UnitIndices neighbours[6];
  for (int face = 0; face < 6; ++face) neighbours[face] = at(unit + faceOffset(face));
  return regulariseUnit(own, neighbours);
}

/// As which direction's a voxel array's samples count on an edge of the given axis and facing. The
/// undirected map's only array (0) holds surfaces of any facing, so there it counts as the direction
/// that faces the way the edge does.
DTSDF_HD int directionOnEdge(int array_direction, int axis, int facing, bool directional) {
  return directional ? array_direction : 2 * axis + facing;
}

/// Steps from a lattice corner to the next one along an axis.
DTSDF_HD int latticeStride(int axis) {
  return axis == 0 ? 1 : (axis == 1 ? kLatticeSide : kLatticeSide * kLatticeSide);
}

}  // namespace dtsdf
