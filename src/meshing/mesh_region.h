/// Which blocks a region's mesh may come from.
#pragma once

#include "kernels/core/grid.h"
#include "kernels/core/region.h"

namespace dtsdf {

/// Whether a vertex of a block's mesh may lie in a region in units of voxels.
inline bool mayHaveVerticesIn(const RegionView& region, const BlockKey& block) {
  constexpr double kMiddle = 4.0;          // vertices lie in [-2, 10], from the first voxel
  constexpr double kReach = 6.0 * 1.7321;  // from the middle to the farthest corner
  const Vec3i first = firstVoxelOfBlock(block);
  return isInside(region, Vec3d{first.x + kMiddle, first.y + kMiddle, first.z + kMiddle}, kReach);
}

}  // namespace dtsdf
