#include "cpu/clear.h"

#include "kernels/fusion/free_space.h"

namespace dtsdf {

void clearFreeSpace(const Vec3i& block_L, const BlockEntry& entry, const FrameSensing& sensing,
                    const Rules& rules, VoxelStore& voxels) {
  const Vec3i first = firstVoxelOfBlock(block_L);
  for (int row = 0; row < kVoxelsPerBlock; row += kBlockSide) {
    float depth_m[kBlockSide], u[kBlockSide], v[kBlockSide];  // apart, for the vector units
    for (int x = 0; x < kBlockSide; ++x) {
      const VoxelInImage at =
          projectToImage(sensing.image.frame, first + voxelOffset(row) + Vec3i{x, 0, 0});
      depth_m[x] = at.depth_m;
      u[x] = at.u;
      v[x] = at.v;
    }
    for (int x = 0; x < kBlockSide; ++x) {
      const float weight =
          freeSpaceWeight(sensing, {depth_m[x], u[x], v[x]}, rules.surfels, rules.fusion);
      if (!(weight > 0.0f)) continue;
      for (const int32_t array : entry.array) {
        if (array == kNoArray) continue;
        Voxel& voxel = voxels.array(array)[row + x];
        voxel = clearedVoxel(voxel, weight, rules.fusion);
      }
    }
  }
}

}  // namespace dtsdf
