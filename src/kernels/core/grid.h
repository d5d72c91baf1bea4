/// Coordinates of blocks and voxels, and the packed key of the spatial hash.
///
/// Samples sit on the corners of the grid: voxel (i, j, k) is at (i, j, k) * voxel size in the map
/// frame W. A block holds the 8 x 8 x 8 voxels that start at 8 * key.
#pragma once

#include "kernels/core/vec.h"

namespace dtsdf {

constexpr int kVoxelsPerBlock = kBlockSide * kBlockSide * kBlockSide;

/// Block coordinates lie in [-kMaxBlockCoordinate, kMaxBlockCoordinate]: 21 bits per axis, or 42 km
/// in each direction at 5 mm voxels.
constexpr int32_t kMaxBlockCoordinate = (1 << 20) - 1;

DTSDF_HD bool isRepresentable(const BlockKey& key) {
  return key.x >= -kMaxBlockCoordinate && key.x <= kMaxBlockCoordinate &&
         key.y >= -kMaxBlockCoordinate && key.y <= kMaxBlockCoordinate &&
         key.z >= -kMaxBlockCoordinate && key.z <= kMaxBlockCoordinate;
}

/// Differences between the packed keys of neighbours along y and z.
constexpr PackedKey kRowStride = PackedKey{1} << 21, kLayerStride = PackedKey{1} << 42;

/// Packs a key so that packed keys sort by z, then y, then x.
DTSDF_HD PackedKey packKey(const BlockKey& key) {
  const int32_t offset = kMaxBlockCoordinate + 1;
  return (static_cast<PackedKey>(key.z + offset) << 42) |
         (static_cast<PackedKey>(key.y + offset) << 21) | static_cast<PackedKey>(key.x + offset);
}

DTSDF_HD BlockKey unpackKey(PackedKey packed) {
  const int32_t offset = kMaxBlockCoordinate + 1;
  const PackedKey mask = (1u << 21) - 1u;
  return {static_cast<int32_t>(packed & mask) - offset,
          static_cast<int32_t>((packed >> 21) & mask) - offset,
          static_cast<int32_t>((packed >> 42) & mask) - offset};
}

/// The 64-bit finaliser of MurmurHash3; spreads neighbouring keys over the whole table.
DTSDF_HD uint64_t hashKey(PackedKey key) {
  key ^= key >> 33;
  key *= 0xff51afd7ed558ccdULL;
  key ^= key >> 33;
  key *= 0xc4ceb9fe1a85ec53ULL;
  key ^= key >> 33;
  return key;
}

/// Rounds towards minus infinity, as all supported compilers shift negative numbers arithmetically.
DTSDF_HD BlockKey blockOfVoxel(const Vec3i& voxel) {
  return {voxel.x >> kBlockSideLog2, voxel.y >> kBlockSideLog2, voxel.z >> kBlockSideLog2};
}

DTSDF_HD Vec3i firstVoxelOfBlock(const BlockKey& key) {
  return {key.x * kBlockSide, key.y * kBlockSide, key.z * kBlockSide};
}

/// Index of a voxel inside its block, x fastest.
DTSDF_HD int voxelIndex(int x, int y, int z) { return x + kBlockSide * (y + kBlockSide * z); }

/// Index of a voxel inside its block, from its coordinates in voxels.
DTSDF_HD int indexInBlock(const Vec3i& voxel) {
  constexpr int kMask = kBlockSide - 1;
  return voxelIndex(voxel.x & kMask, voxel.y & kMask, voxel.z & kMask);
}

DTSDF_HD Vec3i voxelOffset(int index) {
  return {index & (kBlockSide - 1), (index >> kBlockSideLog2) & (kBlockSide - 1),
          index >> (2 * kBlockSideLog2)};
}

}  // namespace dtsdf
