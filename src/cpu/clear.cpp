#include "cpu/clear.h"

#include <algorithm>

#include "kernels/fusion/free_space.h"

namespace dtsdf {
namespace {

/// All voxels are judged before the first one changes: they look at their neighbours.
/// @return the number of voxels that are contradicted.
int findContradicted(const BlockLook& look, int direction, const FrameSensing& sensing,
                     const Voxel* voxels, int (&found)[kVoxelsPerBlock]) {
  const bool has_sums = look.sums != nullptr && (look.directions >> direction & 1);
  const VoxelSums* sums = has_sums ? look.sums->voxel[direction] : nullptr;
  const int facing = look.directional ? direction : kAnyDirection;
  const Vec3f first = toFloat(firstVoxelOfBlock(look.block_L));
  int count = 0;
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    const bool is_supported = sums != nullptr && sums[i].weight != 0;
    if (isEmpty(voxels[i]) || is_supported) continue;
    if (isContradicted(sensing, first, voxels, i, facing)) found[count++] = i;
  }
  return count;
}

}  // namespace

ClearedBlock clearBlock(const BlockLook& look, const BlockEntry& entry, const FrameSensing& sensing,
                        const FusionRules& rules, VoxelStore& voxels) {
  ClearedBlock result{false, 0};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    Voxel* array = voxels.array(entry.array[d]);
    int found[kVoxelsPerBlock];
    const int count = findContradicted(look, d, sensing, array, found);
    if (count == 0) continue;
    result.changed = true;
    for (int i = 0; i < count; ++i) {
      array[found[i]] = contradictedVoxel(array[found[i]], look.frames, rules);
    }
    if (std::all_of(array, array + kVoxelsPerBlock, isEmpty)) result.empty_directions |= 1u << d;
  }
  return result;
}

}  // namespace dtsdf
