/// The bits of a block's voxels and units (kernels/render/block_bits.h) on the CPU.
#pragma once

#include "cpu/voxel_store.h"
#include "kernels/core/direction.h"
#include "kernels/meshing/mesh_tables.h"
#include "kernels/render/block_bits.h"
#include "map/block_table.h"

namespace dtsdf {

/// Of a block's voxels.
struct VoxelBits {
  BlockBits seen[kDirectionCount];  ///< Known in a direction: with a weight and enough evidence.
  BlockBits known;                  ///< In any.
  BlockBits behind;                 ///< Known in some direction, and behind a surface there.
  BlockBits near;                   ///< The same, and near to a surface: isNearRay().
};

VoxelBits voxelBitsOf(const BlockEntry& entry, const VoxelStore& voxels, int32_t least_evidence);

/// Of a block's mesh units, by their corners.
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
