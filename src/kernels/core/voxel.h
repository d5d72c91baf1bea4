/// One sample of a directional signed distance field and how a frame's sums are folded into it.
#pragma once

#include "kernels/core/vec.h"

namespace dtsdf {

/// Signed distance in voxels, positive in front of the surface. Weight 0: never observed; below 0:
/// not observed, but seen as free so often (free_space.h).
struct Voxel {
  float sdf;
  float weight;
};

/// Sums of one voxel over one frame, in fixed point so that they do not depend on the order.
///
/// A weight counts in units of 2^-20 and is at most 2^20; a distance counts in units of
/// truncation / 2^15 and is at most 2^15 in magnitude. A pixel adds less than 2^21 to a voxel's
/// weight: once 2^20 at most, or with its parts together as much, each rounded; a group of n pixels
/// adds n times as much at most. An image has at most kMaxPixels = 2^23 pixels, so |weighted_sdf| <
/// 2^(21+15+23) = 2^59 and weight < 2^44: neither can overflow 64 bits at any image size, range or
/// voxel size.
struct VoxelSums {
  int64_t weighted_sdf;
  int64_t weight;
};

/// A voxel whose weight was spent keeps a debt of at least this: an array that has once held a sample
/// must not read as empty, since only new arrays may be reported so (cuda/fusion.cu).
constexpr float kLeastDebt = 1.0e-6f;

constexpr int kMaxPixels = 1 << 23;
constexpr float kWeightScale = 1048576.0f;  // 2^20
constexpr float kSdfScale = 32768.0f;       // 2^15

/// Rounds a weight in units of 2^-20 that is not negative.
DTSDF_HD int32_t roundWeight(float weight_units) {
  return static_cast<int32_t>(weight_units + 0.5f);
}

/// Rounds a weight in [0, 1] to fixed point.
DTSDF_HD int32_t quantiseWeight(float weight) { return roundWeight(weight * kWeightScale); }

/// Rounds a distance in units of truncation / 2^15.
DTSDF_HD int32_t roundSdf(float sdf_units) { return floorToInt(sdf_units + 0.5f); }

/// Rounds a distance, given as a share of the truncation distance and clamped to [-1, 1].
DTSDF_HD int32_t quantiseSdf(float sdf_share) {
  return roundSdf(minimum(maximum(sdf_share, -1.0f), 1.0f) * kSdfScale);
}

DTSDF_HD void addToSums(VoxelSums& sums, int32_t weight, int32_t sdf) {
  sums.weighted_sdf += static_cast<int64_t>(weight) * sdf;
  sums.weight += weight;
}

/// D = (W D + S_d) / (W + S_w), W = min(W + S_w, max): the fold of the paper's two-pass scheme.
/// The truncation is in voxels; sums of weight 0 leave the voxel alone, and a debt of free space is
/// paid off first.
DTSDF_HD Voxel foldSums(const Voxel& voxel, const VoxelSums& sums, float truncation_voxels,
                        float max_weight) {
  if (sums.weight == 0) return voxel;
  const float weight = static_cast<float>(sums.weight) / kWeightScale;
  const float weighted_sdf = static_cast<float>(sums.weighted_sdf) / (kWeightScale * kSdfScale);
  const float total = voxel.weight + weight;
  if (voxel.weight < 0.0f) {
    const float kept = weighted_sdf < 0.0f ? total : weight;
    if (!(kept > 0.0f)) return {0.0f, minimum(kept, -kLeastDebt)};
    return {weighted_sdf * truncation_voxels / weight, minimum(kept, max_weight)};
  }
  const float sdf = (voxel.weight * voxel.sdf + weighted_sdf * truncation_voxels) / total;
  return {sdf, minimum(total, max_weight)};
}

}  // namespace dtsdf
