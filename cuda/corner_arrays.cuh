/// The voxels at the corners of a block's mesh units, and the labels of those around it, looked up
/// in the device's map. For .cu files.
#pragma once

#include "device_map.cuh"
#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/regularisation.h"

namespace dtsdf {
namespace gpu {

__device__ __forceinline__ BlockKey keyOfSlot(const MapView& map, int32_t slot) {
  return unpackKey(map.slots[slot].key);
}

/// The voxel arrays of a block by direction; null where there is none. @return those it has.
__device__ inline uint32_t findArrays(const MapView& map, const BlockKey& key,
                                      const Voxel* (&arrays)[kDirectionCount]) {
  const int32_t slot = findSlot(map, packKey(key));
  uint32_t present = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    const int32_t array = slot < 0 ? kNoArray : map.slots[slot].array[d];
    arrays[d] = array == kNoArray ? nullptr : map.voxels.record(array);
    present |= (array == kNoArray ? 0u : 1u) << d;
  }
  return present;
}

/// Done by one thread for each n. @return the directions that the n-th block has.
__device__ inline uint32_t findCornerArrays(const MapView& map, const BlockKey& key, int n,
                                            CornerArrays& arrays) {
  return findArrays(map, key + cornerBlockOffset(n), arrays.array[n]);
}

/// The same for the blocks around one.
__device__ inline void findArraysAround(const MapView& map, const BlockKey& key, int n,
                                        ArraysAround& arrays) {
  findArrays(map, key + aroundOffset(n), arrays.array[n]);
}

/// Labels of the units in a block and in those around it; null where there is no block.
struct LabelNeighbourhood {
  const UnitLabels* block[kBlocksAround];

  __device__ UnitLabels operator()(const Vec3i& unit) const {
    const UnitSource source = unitSource(unit);
    const UnitLabels* labels = block[source.block];
    return labels == nullptr ? UnitLabels{0, 0} : labels[source.unit];
  }
};

}  // namespace gpu
}  // namespace dtsdf
