/// What meshing looks up in the device's map: which blocks an extraction has, and the voxels at the
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

/// The voxel arrays of a slot's block by direction; null where there is none. @return those it has.
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

/// Enters a block into the extraction, unless it is there. @return whether it is new.
__device__ __forceinline__ bool select(const MapView& map, const MeshView& mesh, int32_t slot) {
  return atomicExch(&map.mesh_stamp[slot], mesh.stamp) != mesh.stamp;
}

/// Enters a block to be meshed, if there is one and it is not there, behind those that are reached.
__device__ __forceinline__ void selectAdjoining(const MapView& map, const MeshView& mesh,
                                                const BlockKey& key) {
  const int32_t slot = findSlot(map, packKey(key));
  if (slot < 0 || !select(map, mesh, slot)) return;
  mesh.slots[mesh.totals->reached + atomicAdd(&mesh.totals->adjoining, 1u)] = slot;
}

}  // namespace gpu
}  // namespace dtsdf
