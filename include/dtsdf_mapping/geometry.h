/// Plain vectors, and the coordinates of blocks, as they stand in frames and meshes.
#pragma once

#include <cstdint>

namespace dtsdf {

struct Vec3f {
  float x, y, z;
};

struct Vec3i {
  int32_t x, y, z;
};

/// A map is made of blocks of kBlockSide voxels an axis; block (i, j, k) begins at voxel
/// (8 i, 8 j, 8 k), that is at (8 i, 8 j, 8 k) * voxel size in the map frame W.
constexpr int kBlockSideLog2 = 3;
constexpr int kBlockSide = 1 << kBlockSideLog2;

using BlockKey = Vec3i;

/// A block's coordinates in one number, which sorts by z, then y, then x.
using PackedKey = uint64_t;

}  // namespace dtsdf
