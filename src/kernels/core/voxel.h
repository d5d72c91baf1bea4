/// A voxel of a directional signed distance field, and the fixed-point sums that a frame
/// accumulates for a voxel.
#pragma once

#include "kernels/core/anchor.h"
#include "kernels/core/vec.h"

namespace dtsdf {

/// A sample of one direction's surface at a corner of the grid. If all members are zero, nothing is
/// known.
///
/// The weight measures how much was observed, in units of 2^-16; it fits in 24 bits, as
/// fusion/max_weight is below 256. The evidence decides whether there is a surface
/// (fusion/evidence.h). Negative evidence means that free space was observed here; it remains when
/// the distance is cleared.
struct Voxel {
  /// Signed distance, positive in front of the surface, in units of 2^-11 voxels.
  int16_t sdf_units;
  uint16_t anchor;  ///< A nearby point where the surface was measured (anchor.h).
  uint32_t state;   ///< The weight in the upper 24 bits, the signed evidence in the lower 8.
};

constexpr float kStoredSdfScale = 2048.0f;      // 2^11; the largest truncation is 16 voxels
constexpr float kStoredWeightScale = 65536.0f;  // 2^16
constexpr int32_t kMaxEvidence = 127;

/// Rounds a distance in voxels to stored units. `dither` is in [0, 1); 0.5 rounds to the nearest.
DTSDF_HD int16_t storedSdf(float sdf, float dither = 0.5f) {
  constexpr float kMax = 32767.0f;
  const float units = minimum(maximum(sdf * kStoredSdfScale, -kMax), kMax);
  return static_cast<int16_t>(floorToInt(minimum(units + dither, kMax)));
}

DTSDF_HD Voxel makeVoxel(int16_t sdf_units, uint16_t anchor, uint32_t weight_units,
                         int32_t evidence) {
  return {sdf_units, anchor, weight_units << 8 | (static_cast<uint32_t>(evidence) & 255u)};
}

/// A voxel without an anchor; `sdf` is in voxels.
DTSDF_HD Voxel makeVoxel(float sdf, uint32_t weight_units, int32_t evidence) {
  return makeVoxel(storedSdf(sdf), kNoAnchor, weight_units, evidence);
}

/// Signed distance in voxels, positive in front of the surface.
DTSDF_HD float sdfOf(const Voxel& voxel) {
  return static_cast<float>(voxel.sdf_units) * (1.0f / kStoredSdfScale);
}

/// In units of 2^-16.
DTSDF_HD uint32_t weightUnits(const Voxel& voxel) { return voxel.state >> 8; }
DTSDF_HD float weightOf(const Voxel& voxel) {
  return static_cast<float>(static_cast<int32_t>(weightUnits(voxel))) * (1.0f / kStoredWeightScale);
}
DTSDF_HD int32_t evidenceOf(const Voxel& voxel) {
  return static_cast<int32_t>(static_cast<int8_t>(voxel.state & 255u));
}
/// Whether a voxel holds no distance. It may still hold evidence of free space.
DTSDF_HD bool isEmpty(const Voxel& voxel) { return weightUnits(voxel) == 0; }

/// Distance in voxels and weight at a corner, for meshing; weight 0 if unknown.
struct Sample {
  float sdf, weight;
};

/// A voxel's sample, which is unknown if the evidence is below `min_evidence`.
DTSDF_HD Sample sampleOf(const Voxel& voxel, int32_t min_evidence) {
  return {sdfOf(voxel), evidenceOf(voxel) >= min_evidence ? weightOf(voxel) : 0.0f};
}

/// A frame's sums for one voxel, and the measured point nearest to the voxel's foot (anchor.h). The
/// sums are in fixed point, so the order of additions does not matter.
///
/// Weights are in units of 2^-20 and at most 2^20. Distances are in units of truncation / 2^15, and
/// their magnitude is at most 2^15. A pixel (whole, merged or subdivided) adds less than 2^21 to a
/// voxel's weight, and an image has at most kMaxPixels = 2^23 pixels. So |weighted_sdf| <
/// 2^(21+15+23) = 2^59 and weight < 2^44: neither overflows 64 bits.
struct VoxelSums {
  int64_t weighted_sdf;
  int64_t weight;
  uint32_t nearest;  ///< The largest pointKey() (anchor.h); 0 if there is none.
  uint32_t unused;   ///< Explicit padding.
};

constexpr int kMaxPixels = 1 << 23;
constexpr float kWeightScale = 1048576.0f;  // 2^20
constexpr float kSdfScale = 32768.0f;       // 2^15

/// Rounds a non-negative weight, given in units of 2^-20.
DTSDF_HD int32_t roundWeight(float weight_units) {
  return static_cast<int32_t>(weight_units + 0.5f);
}

/// Rounds a weight in [0, 1] to fixed point.
DTSDF_HD int32_t quantiseWeight(float weight) { return roundWeight(weight * kWeightScale); }

/// Rounds a distance given in units of truncation / 2^15.
DTSDF_HD int32_t roundSdf(float sdf_units) { return floorToInt(sdf_units + 0.5f); }

/// Converts a distance, divided by the truncation and clamped to [-1, 1], to fixed point.
DTSDF_HD int32_t quantiseSdf(float sdf_share) {
  return roundSdf(minimum(maximum(sdf_share, -1.0f), 1.0f) * kSdfScale);
}

/// The sums of a single sample; `point_key` is the key of its measured point (anchor.h). A sample
/// of weight 0 contributes nothing.
DTSDF_HD VoxelSums sumsOfSample(int32_t weight, int32_t sdf, uint32_t point_key) {
  return {static_cast<int64_t>(weight) * sdf, weight, weight > 0 ? point_key : 0u, 0};
}

DTSDF_HD void addToSums(VoxelSums& sums, const VoxelSums& sample) {
  sums.weighted_sdf += sample.weighted_sdf;
  sums.weight += sample.weight;
  sums.nearest = sums.nearest > sample.nearest ? sums.nearest : sample.nearest;
}

DTSDF_HD void addToSums(VoxelSums& sums, int32_t weight, int32_t sdf, uint32_t point_key) {
  addToSums(sums, sumsOfSample(weight, sdf, point_key));
}

}  // namespace dtsdf
