/// Plain vectors and block coordinates, used in frames and meshes.
#pragma once

#include <cstdint>

namespace dtsdf {

/// Three numbers. The name and comment of each variable state its frame and unit.
struct Vec3f {
  float x;  ///< First component.
  float y;  ///< Second component.
  float z;  ///< Third component.
};

/// Three integers. The name and comment of each variable state its frame and unit.
struct Vec3i {
  int32_t x;  ///< First component.
  int32_t y;  ///< Second component.
  int32_t z;  ///< Third component.
};

/// Binary logarithm of kBlockSide.
constexpr int kBlockSideLog2 = 3;
/// Edge length of a block, in voxels.
constexpr int kBlockSide = 1 << kBlockSideLog2;

/// Coordinates of a block, in blocks from the origin of the map frame W: block (i, j, k) begins at
/// voxel (8 i, 8 j, 8 k).
using BlockKey = Vec3i;

/// Block coordinates packed into one integer, which sorts by z, then y, then x.
using PackedKey = uint64_t;

}  // namespace dtsdf
