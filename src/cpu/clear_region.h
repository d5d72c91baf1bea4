/// Emptying voxels by where they are, on the CPU.
#pragma once

#include "cpu/voxel_store.h"
#include "kernels/core/region.h"
#include "map/block_table.h"

namespace dtsdf {

/// Empties a block's voxels in a region in units of voxels; not their colours.
EmptiedBlock emptyBlock(const BlockEntry& entry, const RegionView& region, VoxelStore& voxels);

}  // namespace dtsdf
