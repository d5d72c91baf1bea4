/// Brings what is read next nearer, while other work is done.
#pragma once

#include "cpu/voxel_store.h"
#include "map/block_table.h"

namespace dtsdf {

/// The voxel arrays of a block, of some directions, a bit each. Inlined in any case, since GCC
/// drops calls of functions that do nothing else.
__attribute__((always_inline)) inline void prefetchBlock(const BlockEntry& entry,
                                                         const VoxelStore& voxels,
                                                         uint32_t directions = kAllDirections) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] != kNoArray && (directions >> d & 1)) voxels.prefetch(entry.array[d]);
  }
}

}  // namespace dtsdf
