/// Look-ups in a frame's table of touched blocks. For .cu files.
#pragma once

#include "device_map.cuh"
#include "find_blocks.h"

namespace dtsdf {
namespace gpu {

/// Place of a touched block in the frame's table, or -1.
__device__ __forceinline__ int32_t findTouched(const TouchedView& touched, PackedKey key) {
  uint32_t at = static_cast<uint32_t>(hashKey(key)) & touched.mask;
  while (true) {
    const PackedKey found = touched.keys[at];
    if (found == key) return static_cast<int32_t>(at);
    if (found == kNoKey) return -1;
    at = (at + 1) & touched.mask;
  }
}

/// Slot of a touched block, or -1, by the map after the admission: a block that was missing has one
/// now, and one without arrays may have been released since, and its slot be another one's.
__device__ __forceinline__ int32_t slotOf(const MapView& map, const TouchedBlock& block) {
  if (block.slot == kNotInPart) return -1;
  const bool is_there = block.slot >= 0 && map.slots[block.slot].key == block.key;
  return is_there ? block.slot : findSlot(map, block.key);
}

}  // namespace gpu
}  // namespace dtsdf
