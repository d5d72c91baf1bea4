/// Memory of the map on the CPU: voxel arrays in slabs that never move as the map grows.
#pragma once

#include <memory>
#include <vector>

#include "kernels/core/grid.h"
#include "kernels/core/voxel.h"

namespace dtsdf {

class VoxelStore {
 public:
  /// Makes room for `count` arrays. @throws std::bad_alloc
  void resize(size_t count) {
    while (slabs_.size() * kArraysPerSlab < count) {
      slabs_.push_back(std::make_unique<Voxel[]>(kArraysPerSlab * kVoxelsPerBlock));
    }
  }
  void clear() { slabs_.clear(); }
  size_t bytes() const { return slabs_.size() * kArraysPerSlab * kVoxelsPerBlock * sizeof(Voxel); }

  const Voxel* array(int32_t index) const {
    return &slabs_[index / kArraysPerSlab][(index % kArraysPerSlab) * kVoxelsPerBlock];
  }
  Voxel* array(int32_t index) {
    return &slabs_[index / kArraysPerSlab][(index % kArraysPerSlab) * kVoxelsPerBlock];
  }

 private:
  static constexpr size_t kArraysPerSlab = 256;
  std::vector<std::unique_ptr<Voxel[]>> slabs_;
};

}  // namespace dtsdf
