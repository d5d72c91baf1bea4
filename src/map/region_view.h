/// Regions in the form that the rules take.
#pragma once

#include "dtsdf_mapping/region.h"
#include "kernels/core/grid.h"
#include "kernels/core/region.h"

namespace dtsdf {

/// `unit_m`: what the rules count in; a voxel's edge, or 1 for metres.
/// @pre findProblem() found nothing.
RegionView makeRegionView(const Region& region, double unit_m);

/// Whether a block has to do with the mesh in a region in units of voxels: vertices of its mesh may
/// lie there, or outlines lead there.
inline bool mayShapeMeshIn(const RegionView& region, const BlockKey& block) {
  constexpr double kMiddle = 4.0;
  // Vertices lie in [-2, 10], from the first voxel, and an outline is smoothed by those three units
  // away, and by all triangles around these.
  constexpr double kReach = (6.0 + 3.0) * 1.7321;  // from the middle to the farthest corner
  const Vec3i first = firstVoxelOfBlock(block);
  return isInside(region, Vec3d{first.x + kMiddle, first.y + kMiddle, first.z + kMiddle}, kReach);
}

}  // namespace dtsdf
