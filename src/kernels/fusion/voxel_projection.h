/// Fusion by projecting voxels into the image: the paper's mode without ray casting.
#pragma once

#include "kernels/core/direction.h"
#include "kernels/core/voxel.h"
#include "kernels/fusion/free_space.h"
#include "kernels/surfels/surfel.h"

namespace dtsdf {

/// Fuses a voxel with the pixel that it projects to (Curless and Levoy 1996; the paper's VP). Calls
/// add(direction, weight, sdf, point_key), in fixed point, for each direction in which the pixel's
/// surfel has a weight. The distance is the difference between the depths, limited to the
/// truncation distance. Voxels that are outside the image, or behind their surfel by more than the
/// truncation distance, are skipped.
template <class Add>
DTSDF_HD void projectVoxel(const FrameView& frame, const FusionSettings& fusion,
                           const Surfel* surfels, const Vec3i& voxel_L, Add& add) {
  const VoxelInImage at = projectToImage(frame, toFloat(voxel_L));
  if (!isInImage(frame, at)) return;
  const Surfel& surfel =
      surfels[static_cast<int64_t>(at.v) * frame.width + static_cast<int64_t>(at.u)];
  if (!(surfel.weight > 0.0f)) return;
  const float distance = (surfel.depth_m - at.depth_m) / frame.voxel_size_m;
  if (distance < -fusion.truncation_voxels) return;
  const int32_t sdf = quantiseSdf(distance / fusion.truncation_voxels);
  const Vec3f offset = surfel.p_L - toFloat(voxel_L);
  const uint32_t point_key =
      pointKey(offset, {pointShift(0), pointShift(1), pointShift(2)}, dot(surfel.normal_L, offset));
  const DirectionSet directions = directionsOf(surfel.normal_L, fusion.directional != 0);
  for (int i = 0; i < directions.count; ++i) {
    const int32_t weight = quantiseWeight(surfel.weight * directions.weight[i]);
    if (weight > 0) add(directions.direction[i], weight, sdf, point_key);
  }
}

}  // namespace dtsdf
