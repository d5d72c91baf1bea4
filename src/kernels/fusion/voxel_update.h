/// How the sums of a frame are folded into a voxel.
#pragma once

#include "kernels/core/voxel.h"
#include "kernels/fusion/fusion_settings.h"

namespace dtsdf {

/// D = (W D + S_d) / (W + S_w), W = min(W + S_w, max): the fold of the paper's two-pass scheme.
/// Sums of weight 0 leave the voxel alone. A negative weight, which free space has left, is made up
/// for first by samples behind a surface; samples in front agree with the free space, and count at
/// once.
DTSDF_HD Voxel foldSums(const Voxel& voxel, const VoxelSums& sums, const FusionSettings& fusion) {
  if (sums.weight == 0) return voxel;
  const float weight = static_cast<float>(sums.weight) / kWeightScale;
  const float weighted_sdf = static_cast<float>(sums.weighted_sdf) / (kWeightScale * kSdfScale);
  const float total = voxel.weight + weight;
  if (voxel.weight < 0.0f) {
    const float kept = weighted_sdf < 0.0f ? total : weight;
    if (!(kept > 0.0f)) return {0.0f, minimum(kept, -kLeastNegativeWeight)};
    return {weighted_sdf * fusion.truncation_voxels / weight, minimum(kept, fusion.max_weight)};
  }
  const float sdf =
      (voxel.weight * voxel.sdf + weighted_sdf * fusion.truncation_voxels) / total;
  return {sdf, minimum(total, fusion.max_weight)};
}

}  // namespace dtsdf
