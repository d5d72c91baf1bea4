#include "cpu/cast.h"

#include <cstring>

#include "kernels/fusion/voxel_projection.h"

namespace dtsdf {

void clearSums(BlockSums& sums, uint32_t directions) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (directions >> d & 1) std::memset(sums.voxel[d], 0, sizeof(sums.voxel[d]));
  }
}

void cast(const TouchedBlock& block, const BlockFinder& finder, const FusionSettings& fusion,
          BlockSums& sums) {
  auto add = [&](int direction, int index, int32_t weight, int32_t sdf, uint32_t point_key) {
    addToSums(sums.voxel[direction][index], weight, sdf, point_key);
  };
  for (const SurfelRange& range : block.surfels) {
    for (const uint32_t* i = range.begin; i != range.end; ++i) {
      castIntoBlock<kPlanesAtOnce>(finder.line(*i), fusion, block.block_L, add);
    }
  }
}

void project(const TouchedBlock& block, const std::vector<Surfel>& surfels, const FrameView& frame,
             const FusionSettings& fusion, BlockSums& sums) {
  for (int index = 0; index < kVoxelsPerBlock; ++index) {
    auto add = [&](int direction, int32_t weight, int32_t sdf, uint32_t point_key) {
      addToSums(sums.voxel[direction][index], weight, sdf, point_key);
    };
    projectVoxel(frame, fusion, surfels.data(),
                 firstVoxelOfBlock(block.block_L) + voxelOffset(index), add);
  }
}

}  // namespace dtsdf
