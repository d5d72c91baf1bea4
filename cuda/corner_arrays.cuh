/// The voxels at the corners of a block's mesh units, looked up in the device's map. For .cu files.
#pragma once

#include "device_map.cuh"
#include "kernels/meshing/corner_grid.h"

namespace dtsdf {
namespace gpu {

/// The voxel arrays that the corners of a block's units lie in; null where there is none.
struct CornerArrays {
  const Voxel* array[kCornerBlocks][kDirectionCount];

  __device__ Voxel sample(int corner, int direction) const {
    const CornerSource source = cornerSource(corner);
    const Voxel* voxels = array[source.block][direction];
    return voxels == nullptr ? Voxel{0.0f, 0.0f} : voxels[source.voxel];
  }
};

__device__ __forceinline__ BlockKey keyOfSlot(const MapView& map, int32_t slot) {
  return unpackKey(map.slots[slot].key);
}

/// Done by one thread for each n. @return the directions that the n-th block has.
__device__ inline uint32_t findCornerArrays(const MapView& map, const BlockKey& key, int n,
                                            CornerArrays& arrays) {
  const int32_t slot = findSlot(map, packKey(key + cornerBlockOffset(n)));
  uint32_t present = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    const int32_t array = slot < 0 ? kNoArray : map.slots[slot].array[d];
    arrays.array[n][d] = array == kNoArray ? nullptr : map.voxels.record(array);
    present |= (array == kNoArray ? 0u : 1u) << d;
  }
  return present;
}

}  // namespace gpu
}  // namespace dtsdf
