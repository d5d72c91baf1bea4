/// Look-ups of meshing in the device's map: the blocks of an extraction, and the voxels at the
/// corners of a block's mesh units. For .cu files.
#pragma once

#include "device_map.cuh"
#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/regularisation.h"
#include "mesh_kernels.h"

namespace dtsdf {
namespace gpu {

__device__ __forceinline__ BlockKey keyOfSlot(const MapView& map, int32_t slot) {
  return unpackKey(map.slots[slot].key);
}

/// The voxel arrays of a slot's block by direction; null: none. @return a bit for each direction
/// that has one.
__device__ inline uint32_t findArrays(const MapView& map, int32_t slot,
                                      const Voxel* (&arrays)[kDirectionCount]) {
  uint32_t present = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    const int32_t array = slot < 0 ? kNoArray : map.slots[slot].array[d];
    arrays[d] = array == kNoArray ? nullptr : map.voxels.record(array);
    present |= (array == kNoArray ? 0u : 1u) << d;
  }
  return present;
}

/// Adds a block to the extraction, unless it is already there. @return whether it was added.
__device__ __forceinline__ bool select(const MapView& map, const MeshView& mesh, int32_t slot) {
  return atomicExch(&map.mesh_stamp[slot], mesh.stamp) != mesh.stamp;
}

/// Adds a block to be meshed after the reached ones, if it exists and is not there yet.
__device__ __forceinline__ void selectAdjoining(const MapView& map, const MeshView& mesh,
                                                const BlockKey& key) {
  const int32_t slot = findSlot(map, packKey(key));
  if (slot < 0 || !select(map, mesh, slot)) return;
  mesh.slots[mesh.totals->reached + atomicAdd(&mesh.totals->adjoining, 1u)] = slot;
}

}  // namespace gpu
}  // namespace dtsdf
