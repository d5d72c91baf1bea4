/// The corner grid of a block: the corners and edges of its mesh units, their indices, and where
/// the corners' samples are stored.
#pragma once

#include "kernels/core/direction.h"
#include "kernels/core/grid.h"
#include "kernels/core/voxel.h"

namespace dtsdf {

/// The corners of a block's 8 x 8 x 8 units form a 9 x 9 x 9 grid.
constexpr int kCornerGridSide = kBlockSide + 1;
constexpr int kGridCorners = kCornerGridSide * kCornerGridSide * kCornerGridSide;
constexpr int kGridEdges = kGridCorners * 3 * 2;

DTSDF_HD constexpr int cornerIndex(int x, int y, int z) {
  return x + kCornerGridSide * (y + kCornerGridSide * z);
}

DTSDF_HD Vec3i cornerAt(int index) {
  return {index % kCornerGridSide, index / kCornerGridSide % kCornerGridSide,
          index / (kCornerGridSide * kCornerGridSide)};
}

/// Index of an edge (BlockVertex::edge), from its lower corner, axis and facing (0 if the lower end
/// is behind the surface), and the inverse functions.
DTSDF_HD constexpr int edgeNumber(int corner, int axis, int facing) {
  return (corner * 3 + axis) * 2 + facing;
}
DTSDF_HD int edgeCorner(int edge) { return edge / 6; }
DTSDF_HD int edgeAxis(int edge) { return edge / 2 % 3; }
DTSDF_HD int edgeFacing(int edge) { return edge & 1; }

/// A step along an axis of the grid.
DTSDF_HD Vec3i gridStep(int axis, int32_t length) {
  return {axis == 0 ? length : 0, axis == 1 ? length : 0, axis == 2 ? length : 0};
}
DTSDF_HD Vec3i unitStep(int axis) { return gridStep(axis, 1); }

/// Unit step along an edge from its end behind the surface to its end in front of it.
DTSDF_HD Vec3i facingStep(int edge) {
  return gridStep(edgeAxis(edge), edgeFacing(edge) == 0 ? 1 : -1);
}

/// Difference between the indices of neighbouring corners along an axis.
DTSDF_HD int cornerStride(int axis) {
  return axis == 0 ? 1 : (axis == 1 ? kCornerGridSide : kCornerGridSide * kCornerGridSide);
}

/// Offsets in {-1, 0}^3, from a block to the blocks whose units have a corner in it; offset 0 is
/// the block itself.
constexpr int kUnitReach = 8;
DTSDF_HD Vec3i unitReachOffset(int n) { return {-(n & 1), -(n >> 1 & 1), -(n >> 2 & 1)}; }

/// Offsets in {0, 1}^3, from a block to the blocks that hold the corners of its units; offset 0 is
/// the block itself.
constexpr int kCornerBlocks = 8;
DTSDF_HD Vec3i cornerBlockOffset(int n) { return {n & 1, n >> 1 & 1, n >> 2 & 1}; }

/// Location of a corner's sample: the index of the block (of kCornerBlocks) and of the voxel in the
/// block.
struct CornerSource {
  int block, voxel;
};

DTSDF_HD CornerSource cornerSource(const Vec3i& corner) {
  return {corner.x >> kBlockSideLog2 | (corner.y >> kBlockSideLog2) << 1 |
              (corner.z >> kBlockSideLog2) << 2,
          indexInBlock(corner)};
}
DTSDF_HD CornerSource cornerSource(int corner) { return cornerSource(cornerAt(corner)); }

/// Offsets in {-1, 0, 1}^3, from a block to the blocks that hold its corner grid when extended by
/// one layer, and the inverse function.
constexpr int kBlocksAround = 27;
DTSDF_HD Vec3i aroundOffset(int n) { return {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1}; }
DTSDF_HD int aroundNumber(const Vec3i& offset) {
  return offset.x + 1 + 3 * (offset.y + 1) + 9 * (offset.z + 1);
}

/// Index (aroundNumber()) of the block that holds a corner; each coordinate is in [-8, 16).
DTSDF_HD int blockAround(const Vec3i& corner) { return aroundNumber(blockOfVoxel(corner)); }

/// The voxel arrays of a block and of the blocks around it; null for missing arrays.
struct ArraysAround {
  const Voxel* array[kBlocksAround][kDirectionCount];
  int32_t min_evidence;  ///< Minimum evidence of a known voxel.

  DTSDF_HD Voxel voxel(const Vec3i& corner, int direction) const {
    const Voxel* voxels = array[blockAround(corner)][direction];
    return voxels == nullptr ? Voxel{0, kNoAnchor, 0} : voxels[indexInBlock(corner)];
  }
  DTSDF_HD Sample sample(const Vec3i& corner, int direction) const {
    return sampleOf(voxel(corner, direction), min_evidence);
  }
  DTSDF_HD Sample sample(int corner, int direction) const {
    return sample(cornerAt(corner), direction);
  }
};

/// The voxel arrays that hold the corners of a block's units; null for missing arrays.
struct CornerArrays {
  const Voxel* array[kCornerBlocks][kDirectionCount];

  int32_t min_evidence;  ///< Minimum evidence of a known voxel.

  DTSDF_HD Sample sample(int corner, int direction) const {
    return sample(cornerSource(corner), direction);
  }
  DTSDF_HD Sample sample(const CornerSource& source, int direction) const {
    const Voxel* voxels = array[source.block][direction];
    return voxels == nullptr ? Sample{0.0f, 0.0f} : sampleOf(voxels[source.voxel], min_evidence);
  }
};

}  // namespace dtsdf
