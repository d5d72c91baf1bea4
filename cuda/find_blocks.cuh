/// Look-ups in a frame's table of touched blocks. Include only in .cu files.
#pragma once

#include "device_map.cuh"
#include "find_blocks.h"
#include "kernels/fusion/sample_line.h"

namespace dtsdf {
namespace gpu {

/// A part of the line along which a surfel updates voxels, handled by one thread. Lines are long,
/// so they are divided among several threads if there are enough. The sums do not depend on this.
struct LinePart {
  uint32_t surfel;
  int number, count_log2;

  __device__ __forceinline__ void takeFrom(SampleLine& line) const {
    const int first = line.first_plane, planes = line.last_plane - first + 1;
    line.first_plane = first + (planes * number >> count_log2);
    line.last_plane = first + (planes * (number + 1) >> count_log2) - 1;
  }
};

__device__ __forceinline__ LinePart linePartOf(const DeviceSurfels& surfels) {
  const uint32_t size = surfels.size(), share = gridDim.x * blockDim.x / (size == 0 ? 1 : size);
  const int parts_log2 = share >= 4 ? 2 : (share >= 2 ? 1 : 0);
  const auto thread = static_cast<uint32_t>(globalThread());
  return {thread >> parts_log2, static_cast<int>(thread & ((1u << parts_log2) - 1u)), parts_log2};
}

/// Index of a touched block's entry in the frame's table; -1 if the block is not touched.
__device__ __forceinline__ int32_t findTouched(const TouchedView& touched, PackedKey key) {
  uint32_t at = static_cast<uint32_t>(hashKey(key)) & touched.mask;
  while (true) {
    const PackedKey found = touched.keys[at];
    if (found == key) return static_cast<int32_t>(at);
    if (found == kNoKey) return -1;
    at = (at + 1) & touched.mask;
  }
}

/// Current slot of a touched block in the map; -1 if it has none. Since BlockFinder::compare(), a
/// missing block may have been given a slot, and a block without arrays may have lost its slot to
/// another block.
__device__ __forceinline__ int32_t slotOf(const MapView& map, const TouchedBlock& block) {
  const bool is_there = block.slot >= 0 && map.slots[block.slot].key == block.key;
  return is_there ? block.slot : findSlot(map, block.key);
}

}  // namespace gpu
}  // namespace dtsdf
