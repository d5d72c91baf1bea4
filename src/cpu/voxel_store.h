/// Memory for the map on the CPU: arrays in slabs, which do not move as the map grows.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "kernels/core/grid.h"
#include "kernels/core/voxel.h"
#include "kernels/core/voxel_colour.h"
#include "map/block_table.h"

namespace dtsdf {

/// Arrays of kSize elements.
template <class T, int kSize>
class ArrayStore {
 public:
  /// Allocates memory for at least `count` arrays, uninitialised. @throws std::bad_alloc
  void resize(size_t count) {
    while (slabs_.size() * kArraysPerSlab < count) {
      std::unique_ptr<T[]> slab(new T[kArraysPerSlab * kSize]);  // make_unique() would zero it
      slabs_.push_back(std::move(slab));
    }
  }
  size_t bytes() const { return slabs_.size() * kArraysPerSlab * kSize * sizeof(T); }

  const T* array(int32_t index) const {
    return &slabs_[index / kArraysPerSlab][(index % kArraysPerSlab) * kSize];
  }
  void prefetch(int32_t index) const {
    constexpr int kPerCacheLine = 64 / sizeof(T);
    const T* const elements = array(index);
    for (int i = 0; i < kSize; i += kPerCacheLine) __builtin_prefetch(elements + i);
  }
  T* array(int32_t index) {
    return &slabs_[index / kArraysPerSlab][(index % kArraysPerSlab) * kSize];
  }

 private:
  static constexpr size_t kArraysPerSlab = 256;
  std::vector<std::unique_ptr<T[]>> slabs_;
};

using VoxelStore = ArrayStore<Voxel, kVoxelsPerBlock>;
using ColourStore = ArrayStore<VoxelColour, kVoxelsPerBrick>;

struct CpuMap {
  const BlockTable& table;
  VoxelStore voxels;
  ColourStore colours;
};

/// Prefetches a block's voxel arrays in `directions` (one bit each). Always inlined, since GCC
/// drops calls to functions that only prefetch.
__attribute__((always_inline)) inline void prefetchBlock(const BlockEntry& entry, const CpuMap& map,
                                                         uint32_t directions = kAllDirections) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] != kNoArray && (directions >> d & 1)) map.voxels.prefetch(entry.array[d]);
  }
}

__attribute__((always_inline)) inline void prefetchColours(const BlockEntry& entry,
                                                           const CpuMap& map) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    for (int brick = 0; brick < kBricksPerArray; ++brick) {
      const int32_t number = map.table.colourOf(entry.array[d], brick);
      if (number != kNoArray) map.colours.prefetch(number);
    }
  }
}

}  // namespace dtsdf
