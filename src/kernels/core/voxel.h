/// One sample of a directional signed distance field, and the fixed-point sums of a frame for it.
#pragma once

#include "kernels/core/vec.h"

namespace dtsdf {

/// Signed distance in voxels, positive in front of the surface. Weight 0: never observed; below 0:
/// not observed, but seen as free (fusion/free_space.h).
struct Voxel {
  float sdf;
  float weight;
};

/// Sums of one voxel over one frame, in fixed point so that they do not depend on the order.
///
/// A weight counts in units of 2^-20 and is at most 2^20; a distance counts in units of
/// truncation / 2^15 and is at most 2^15 in magnitude. A pixel adds less than 2^21 to a voxel's
/// weight: once 2^20 at most, or with its subpixels together as much, each rounded; n merged pixels
/// add n times as much at most. An image has at most kMaxPixels = 2^23 pixels, so |weighted_sdf| <
/// 2^(21+15+23) = 2^59 and weight < 2^44: neither can overflow 64 bits at any image size, range or
/// voxel size.
struct VoxelSums {
  int64_t weighted_sdf;
  int64_t weight;
};

/// A voxel whose weight was spent keeps a negative weight of at least this magnitude: an array that
/// has once held a sample must not read as empty, since only new arrays may be reported so.
constexpr float kLeastNegativeWeight = 1.0e-6f;

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

}  // namespace dtsdf
