/// Tests whether points and voxels lie in a region of space. All tests use doubles, which represent
/// voxel coordinates exactly anywhere in a map.
#pragma once

#include "kernels/core/grid.h"

namespace dtsdf {

struct Vec3d {
  double x, y, z;
};

/// A box or a ball in the map frame W, in the same unit as the points that are tested.
struct RegionView {
  double R_B_W[9];  ///< Row-major; its rows are the directions of the box's edges in W.
  Vec3d center;
  Vec3d half;         ///< Half the box's extents.
  double radius;      ///< Radius of a ball.
  int32_t is_sphere;  ///< 1 for a ball, 0 for a box.
};

DTSDF_HD Vec3d fromCentre(const RegionView& region, const Vec3d& p) {
  return {p.x - region.center.x, p.y - region.center.y, p.z - region.center.z};
}

DTSDF_HD bool isWithin(double x, double limit) { return -limit <= x && x <= limit; }

/// Whether a point lies in the region grown by `margin` on all sides.
DTSDF_HD bool isInside(const RegionView& region, const Vec3d& p, double margin = 0.0) {
  const Vec3d d = fromCentre(region, p);
  if (region.is_sphere) {
    const double reach = region.radius + margin;
    return d.x * d.x + d.y * d.y + d.z * d.z <= reach * reach;
  }
  const double* R = region.R_B_W;
  return isWithin(R[0] * d.x + R[1] * d.y + R[2] * d.z, region.half.x + margin) &&
         isWithin(R[3] * d.x + R[4] * d.y + R[5] * d.z, region.half.y + margin) &&
         isWithin(R[6] * d.x + R[7] * d.y + R[8] * d.z, region.half.z + margin);
}

/// Whether a voxel lies in a region given in voxels.
DTSDF_HD bool isInside(const RegionView& region, const Vec3i& voxel) {
  return isInside(region, Vec3d{static_cast<double>(voxel.x), static_cast<double>(voxel.y),
                                static_cast<double>(voxel.z)});
}

/// Whether any voxel of a block may lie in a region given in voxels; false only if none does.
DTSDF_HD bool mayBeInside(const RegionView& region, const BlockKey& block) {
  constexpr double kMiddle = 0.5 * (kBlockSide - 1);
  constexpr double kReach = 6.1;  // from the middle to a corner: 3.5 sqrt(3)
  const Vec3i first = firstVoxelOfBlock(block);
  return isInside(region, Vec3d{first.x + kMiddle, first.y + kMiddle, first.z + kMiddle}, kReach);
}

}  // namespace dtsdf
