/// Look-ups in the map on the device. Include only in .cu files.
#pragma once

#include "device_map.h"
#include "launch.h"

namespace dtsdf {
namespace gpu {

/// Slot of a block; -1 if there is none. The table is at most half full, so the search is short.
__device__ __forceinline__ int32_t findSlot(const MapView& map, PackedKey key) {
  uint32_t at = static_cast<uint32_t>(hashKey(key)) & map.hash_mask;
  while (true) {
    const PackedKey found = map.hash_keys[at];
    if (found == key) return map.hash_slots[at];
    if (found == kNoKey) return -1;
    at = (at + 1) & map.hash_mask;
  }
}

/// Inserts a key. Reuses the entry of a released block with this key.
__device__ inline void insertSlot(const MapView& map, PackedKey key, int32_t slot) {
  uint32_t at = static_cast<uint32_t>(hashKey(key)) & map.hash_mask;
  while (true) {
    const PackedKey found =
        atomicCAS(reinterpret_cast<unsigned long long*>(&map.hash_keys[at]), kNoKey, key);
    if (found == kNoKey || found == key) break;
    at = (at + 1) & map.hash_mask;
  }
  map.hash_slots[at] = slot;
}

__device__ inline void updateSlot(const MapView& map, const SlotUpdate& update) {
  SlotEntry entry = update.entry;
  if (!update.in_use) entry.key = kNoKey;
  map.slots[update.slot] = entry;
  insertSlot(map, update.entry.key, update.in_use ? update.slot : -1);
}

/// The directions of a slot's arrays, one bit each.
__device__ __forceinline__ uint32_t directionsOfSlot(const SlotEntry& entry) {
  uint32_t mask = 0;
  for (int d = 0; d < kDirectionCount; ++d) mask |= (entry.array[d] != kNoArray ? 1u : 0u) << d;
  return mask;
}

/// The colours in a brick (4 x 4 x 4 voxels) of an array; null if the brick does not exist.
__device__ __forceinline__ VoxelColour* coloursOf(const MapView& map, int32_t array, int brick) {
  if (map.colour_of == nullptr) return nullptr;
  const int32_t number = map.colour_of[static_cast<size_t>(array) * kBricksPerArray + brick];
  return number == 0 ? nullptr : map.colours.record(number - 1);
}

/// The colour of a voxel in an array; null if its brick does not exist.
__device__ __forceinline__ VoxelColour* colourOf(const MapView& map, int32_t array, int voxel) {
  VoxelColour* colours = coloursOf(map, array, brickOf(voxel));
  return colours == nullptr ? nullptr : colours + placeInBrick(voxel);
}

/// Removes the colour of an emptied voxel, so that a surface fused there later does not inherit it.
__device__ __forceinline__ void forgetColour(const MapView& map, int32_t array, int index) {
  VoxelColour* colour = colourOf(map, array, index);
  if (colour != nullptr) *colour = {0, 0, 0, 0};
}

/// Adds a block to a list of changed blocks, unless it is already listed.
__device__ __forceinline__ void mark(const ChangedBlocks& changed, int32_t slot) {
  if (readShared(&changed.flags[slot]) == 0 && atomicExch(&changed.flags[slot], 1u) == 0) {
    changed.slots[atomicAdd(changed.count, 1u)] = slot;
  }
}

}  // namespace gpu
}  // namespace dtsdf
