/// The samples of a mesh unit, read where they are. For .cu files.
#pragma once

#include "device_map.cuh"

namespace dtsdf {
namespace gpu {

/// A corner of a unit: the arrays of its block, and its place in them.
struct UnitCorner {
  int32_t slot;  ///< -1: none.
  int32_t voxel;
};

/// Samples of a unit that are read when they are asked for: threads side by side read the same
/// ones.
struct ReadSamples {
  using Real = float;
  using Bits = int32_t;
  const MapView& map;
  int32_t least_evidence;
  UnitCorner corner[kCubeCorners];
  uint32_t observed;

  __device__ __forceinline__ Sample at(int direction, int c) const {
    const int32_t array =
        corner[c].slot < 0 ? kNoArray : map.slots[corner[c].slot].array[direction];
    if (array == kNoArray) return {0.0f, 0.0f};
    return sampleOf(map.voxels.record(array)[corner[c].voxel], least_evidence);
  }
  __device__ __forceinline__ float sdf(int direction, int c) const { return at(direction, c).sdf; }
  __device__ __forceinline__ float weight(int direction, int c) const {
    return at(direction, c).weight;
  }
  __device__ __forceinline__ bool isObserved(int direction) const {
    return (observed >> direction & 1) != 0;
  }
  __device__ __forceinline__ bool maySpeak(int direction) const { return isObserved(direction); }
};

/// Directions that know some corner, a bit each.
__device__ __forceinline__ uint32_t observedBy(const ReadSamples& samples) {
  uint32_t observed = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    bool is_known = false;
    for (int c = 0; c < kCubeCorners; ++c) is_known = is_known || samples.weight(d, c) > 0.0f;
    observed |= (is_known ? 1u : 0u) << d;
  }
  return observed;
}

}  // namespace gpu
}  // namespace dtsdf
