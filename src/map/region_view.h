/// Converts regions to the form that the rules use.
#pragma once

#include "dtsdf_mapping/region.h"
#include "kernels/core/grid.h"
#include "kernels/core/region.h"

namespace dtsdf {

/// @param unit_m Unit of the result: the edge of a voxel, or 1 for metres.
/// @pre findProblem(region) is empty.
RegionView makeRegionView(const Region& region, double unit_m);

/// Whether a block may affect the mesh in a region, which is in units of voxels: its vertices may
/// lie there, or affect the outlines there.
inline bool mayAffectMeshIn(const RegionView& region, const BlockKey& block) {
  constexpr double kMiddle = 4.0;
  // Vertices lie in [-2, 10] from the first voxel. What closes a crack depends on crumbs up to two
  // blocks away, and whether a piece is a crumb on others up to two blocks from it.
  constexpr double kReach = (6.0 + 32.0) * 1.7321;  // from the centre to the farthest corner
  const Vec3i first = firstVoxelOfBlock(block);
  return isInside(region, Vec3d{first.x + kMiddle, first.y + kMiddle, first.z + kMiddle}, kReach);
}

}  // namespace dtsdf
