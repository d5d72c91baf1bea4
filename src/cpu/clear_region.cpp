#include "cpu/clear_region.h"

#include <algorithm>

namespace dtsdf {

EmptiedBlock emptyBlock(const BlockEntry& entry, const RegionView& region, VoxelStore& voxels) {
  const Vec3i first = firstVoxelOfBlock(entry.key);
  bool inside[kVoxelsPerBlock];
  for (int i = 0; i < kVoxelsPerBlock; ++i) inside[i] = isInside(region, first + voxelOffset(i));
  EmptiedBlock result{0, 0};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    Voxel* array = voxels.array(entry.array[d]);
    uint32_t emptied = 0;
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      if (!inside[i]) continue;
      emptied += isEmpty(array[i]) ? 0u : 1u;
      array[i] = Voxel{};
    }
    if (emptied == 0) continue;
    result.voxels += emptied;
    if (std::all_of(array, array + kVoxelsPerBlock, isEmpty)) result.empty_directions |= 1u << d;
  }
  return result;
}

}  // namespace dtsdf
