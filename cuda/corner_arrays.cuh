/// Functions with which meshing kernels find the voxel arrays of a block and select blocks for an
/// extraction. Include only in .cu files.
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

/// Finds the voxel arrays of a block, indexed by direction; null where there is none. `slot` is -1
/// if the block does not exist.
/// @return the directions that have an array, one bit each.
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

/// Marks a block as selected for the extraction. @return false if it was selected before.
__device__ __forceinline__ bool select(const MapView& map, const MeshView& mesh, int32_t slot) {
  return atomicExch(&map.mesh_stamp[slot], mesh.stamp) != mesh.stamp;
}

/// Selects a block to be meshed with its stored marching cubes cases, if it exists and has not been
/// selected yet.
__device__ __forceinline__ void selectAdjoining(const MapView& map, const MeshView& mesh,
                                                const BlockKey& key) {
  const int32_t slot = findSlot(map, packKey(key));
  if (slot < 0 || !select(map, mesh, slot)) return;
  mesh.slots[mesh.totals->reached + atomicAdd(&mesh.totals->adjoining, 1u)] = slot;
}

}  // namespace gpu
}  // namespace dtsdf
