/// The corner grid of a block: the corners and edges of its mesh units, numbered, and where in the
/// block and around it their samples lie.
#pragma once

#include "kernels/core/direction.h"
#include "kernels/core/grid.h"
#include "kernels/core/voxel.h"

namespace dtsdf {

/// The corners of a block's 8 x 8 x 8 units form its corner grid, 9 x 9 x 9.
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

/// BlockVertex::edge from the edge's lower corner, its axis and its facing (0: behind at the lower
/// end); and back.
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

/// The way that an edge's facing looks: from its end behind the surface to that in front.
DTSDF_HD Vec3i facedWay(int edge) {
  return gridStep(edgeAxis(edge), edgeFacing(edge) == 0 ? 1 : -1);
}

/// Steps from a corner to the next one along an axis.
DTSDF_HD int cornerStride(int axis) {
  return axis == 0 ? 1 : (axis == 1 ? kCornerGridSide : kCornerGridSide * kCornerGridSide);
}

/// {-1, 0}^3: the blocks whose units have a corner in a block, itself included.
constexpr int kUnitReach = 8;
DTSDF_HD Vec3i unitReachOffset(int n) { return {-(n & 1), -(n >> 1 & 1), -(n >> 2 & 1)}; }

/// {0, 1}^3: the blocks that the corners of a block's units lie in; 0 is the block itself.
constexpr int kCornerBlocks = 8;
DTSDF_HD Vec3i cornerBlockOffset(int n) { return {n & 1, n >> 1 & 1, n >> 2 & 1}; }

/// Where the sample of a corner lies: in which of the grid's blocks, at which voxel.
struct CornerSource {
  int block, voxel;
};

DTSDF_HD CornerSource cornerSource(const Vec3i& corner) {
  return {corner.x >> kBlockSideLog2 | (corner.y >> kBlockSideLog2) << 1 |
              (corner.z >> kBlockSideLog2) << 2,
          indexInBlock(corner)};
}
DTSDF_HD CornerSource cornerSource(int corner) { return cornerSource(cornerAt(corner)); }

/// {-1, 0, 1}^3: the blocks that a corner grid with one more layer around it lies in; and back.
constexpr int kBlocksAround = 27;
DTSDF_HD Vec3i aroundOffset(int n) { return {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1}; }
DTSDF_HD int aroundNumber(const Vec3i& offset) {
  return offset.x + 1 + 3 * (offset.y + 1) + 9 * (offset.z + 1);
}

/// Which of those blocks a corner lies in; each coordinate is in [-8, 16).
DTSDF_HD int blockAround(const Vec3i& corner) { return aroundNumber(blockOfVoxel(corner)); }

/// The voxel arrays around a block; null where there is none.
struct ArraysAround {
  const Voxel* array[kBlocksAround][kDirectionCount];
  int32_t least_evidence;  ///< That a voxel needs to be known.

  DTSDF_HD Voxel voxel(const Vec3i& corner, int direction) const {
    const Voxel* voxels = array[blockAround(corner)][direction];
    return voxels == nullptr ? Voxel{0, kNoAnchor, 0} : voxels[indexInBlock(corner)];
  }
  DTSDF_HD Sample sample(const Vec3i& corner, int direction) const {
    return sampleOf(voxel(corner, direction), least_evidence);
  }
  DTSDF_HD Sample sample(int corner, int direction) const {
    return sample(cornerAt(corner), direction);
  }
};

/// The voxel arrays that the corners of a block's units lie in; null where there is none.
struct CornerArrays {
  const Voxel* array[kCornerBlocks][kDirectionCount];

  int32_t least_evidence;  ///< That a voxel needs to be known.

  DTSDF_HD Sample sample(int corner, int direction) const {
    return sample(cornerSource(corner), direction);
  }
  DTSDF_HD Sample sample(const CornerSource& source, int direction) const {
    const Voxel* voxels = array[source.block][direction];
    return voxels == nullptr ? Sample{0.0f, 0.0f} : sampleOf(voxels[source.voxel], least_evidence);
  }
};

}  // namespace dtsdf
