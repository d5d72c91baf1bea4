/// What rays have to know of a block before they look at its voxels: a bit for each of them, and
/// for each of its mesh units.
#pragma once

#include <cstdint>

#include "cpu/voxel_store.h"
#include "kernels/core/direction.h"
#include "kernels/core/grid.h"
#include "kernels/meshing/mesh_tables.h"
#include "map/block_table.h"

namespace dtsdf {

/// A bit for each voxel of a block, or for the unit that begins at it: a word per layer, 8 bits a
/// row.
struct BlockBits {
  uint64_t layer[kBlockSide];

  bool has(const Vec3i& voxel) const {
    return (layer[voxel.z & kLast] >> rowBit(voxel) & 1) != 0;
  }
  static int rowBit(const Vec3i& voxel) {
    return (voxel.x & kLast) + kBlockSide * (voxel.y & kLast);
  }
  static constexpr int kLast = kBlockSide - 1;
};

/// Of a block's voxels.
struct VoxelBits {
  BlockBits seen[kDirectionCount];  ///< Known in a direction: with a weight and enough evidence.
  BlockBits known;                  ///< In any.
  BlockBits behind;                 ///< Known in some direction, and behind a surface there.
  BlockBits near;                   ///< The same, and near to a surface: isNearRay().
};

VoxelBits voxelBitsOf(const BlockEntry& entry, const VoxelStore& voxels, int32_t least_evidence);

/// Of a block's mesh units: what kernels/render/ray_unit.h asks of their corners first.
struct UnitBits {
  BlockBits seen[kDirectionCount];  ///< Some corner.
  BlockBits known;                  ///< All corners.
  BlockBits behind;                 ///< Some corner.
};

/// A block, and those that its units reach into, by the corner of a unit that lies there; null:
/// nothing is known there.
using BlocksAround = const VoxelBits* [kCubeCorners];

UnitBits unitBitsOf(const BlocksAround& around);

}  // namespace dtsdf
