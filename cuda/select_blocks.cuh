/// Entering blocks into an extraction, on the device. For .cu files.
#pragma once

#include "device_map.cuh"
#include "mesh_kernels.h"

namespace dtsdf {
namespace gpu {

/// Enters a block into the extraction, unless it is there. @return whether it is new.
__device__ __forceinline__ bool select(const MapView& map, const MeshView& mesh, int32_t slot) {
  return atomicExch(&map.mesh_stamp[slot], mesh.stamp) != mesh.stamp;
}

/// Enters a block to be meshed, if there is one and it is not there, behind those that are reached.
__device__ __forceinline__ void selectAdjoining(const MapView& map, const MeshView& mesh,
                                                const BlockKey& key) {
  const int32_t slot = findSlot(map, packKey(key));
  if (slot < 0 || !select(map, mesh, slot)) return;
  mesh.slots[mesh.counters->reached + atomicAdd(&mesh.counters->adjoining, 1u)] = slot;
}

}  // namespace gpu
}  // namespace dtsdf
