/// Converts regions to the form used by the kernels (src/kernels).
#pragma once

#include "dtsdf_mapping/region.h"
#include "kernels/core/grid.h"
#include "kernels/core/region.h"

namespace dtsdf {

/// @param unit_m Length unit of the result, in metres (the edge of a voxel, or 1).
/// @pre findProblem(region) is empty.
RegionView makeRegionView(const Region& region, double unit_m);

/// Whether a block can affect the mesh in a region, either directly or when outlines are mended.
/// The region is in voxels.
inline bool mayAffectMeshIn(const RegionView& region, const BlockKey& block) {
  constexpr double kMiddle = 4.0;
  // A block's vertices have coordinates in [-2, 10] relative to its first voxel. How a gap is
  // closed (see meshing/mend.h) depends on crumbs up to two blocks away; whether a piece is a crumb
  // depends on pieces up to two blocks away.
  constexpr double kReach = (6.0 + 32.0) * 1.7321;  // from the centre to the farthest corner
  const Vec3i first = firstVoxelOfBlock(block);
  return isInside(region, Vec3d{first.x + kMiddle, first.y + kMiddle, first.z + kMiddle}, kReach);
}

}  // namespace dtsdf
