#include "cpu/fold.h"

#include <algorithm>

#include "kernels/fusion/voxel_update.h"

namespace dtsdf {
namespace {

/// @return whether the array holds anything.
bool foldArray(const VoxelSums* sums, const VoxelSet& covered, float depth_weight,
               const FusionSettings& fusion, Voxel* voxels) {
  bool observed = false;
  covered.forEach([&](int i) {
    voxels[i] = foldSums(voxels[i], sums[i], depth_weight, fusion);
    observed |= !isEmpty(voxels[i]);
  });
  return observed || !std::all_of(voxels, voxels + kVoxelsPerBlock, isEmpty);
}

}  // namespace

uint32_t fold(BlockSums& sums, uint32_t directions, const BlockEntry& entry, float depth_weight,
              const FusionSettings& fusion, VoxelStore& voxels) {
  uint32_t empty = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    const int32_t array = entry.array[d];
    if (array == kNoArray || !(directions >> d & 1)) continue;
    findCovered(sums, d);
    const bool observed =
        foldArray(sums.voxel[d], sums.covered[d], depth_weight, fusion, voxels.array(array));
    if (!observed) empty |= 1u << d;
  }
  return empty;
}

}  // namespace dtsdf
