/// Emptying voxels by where they are, on the CPU.
#pragma once

#include "cpu/voxel_store.h"
#include "kernels/core/region.h"
#include "map/block_table.h"

namespace dtsdf {

/// What a block lost.
struct EmptiedBlock {
  size_t voxels;              ///< That held something.
  uint32_t empty_directions;  ///< Bit d: the array of direction d was emptied.
};

/// Empties a block's voxels in a region in units of voxels; not their colours.
EmptiedBlock emptyRegion(const BlockEntry& entry, const RegionView& region, VoxelStore& voxels);

}  // namespace dtsdf
