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

/// The colours of a block, of all directions.
__attribute__((always_inline)) inline void prefetchColours(const BlockEntry& entry,
                                                           const BlockTable& table,
                                                           const ColourStore& colours) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    for (int brick = 0; brick < kBricksPerArray; ++brick) {
      const int32_t number = table.colourOf(entry.array[d], brick);
      if (number != kNoArray) colours.prefetch(number);
    }
  }
}

}  // namespace dtsdf
