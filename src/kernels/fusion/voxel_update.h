/// Folds a frame's sums into a voxel: updates its distance, weight, anchor and evidence.
#pragma once

#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "kernels/core/select.h"
#include "kernels/fusion/evidence.h"

namespace dtsdf {

/// Weight of a frame at a depth: min(1, (full_weight_depth_m / z)^2).
DTSDF_HD float depthWeight(float depth_m, const FusionRules& rules) {
  const float full_m = rules.full_weight_depth_m;
  return depth_m <= full_m ? 1.0f : full_m * full_m / (depth_m * depth_m);
}

/// Weight of a frame for all voxels of a block, from the depth of the block's centre.
DTSDF_HD float blockDepthWeight(const FrameView& frame, const Vec3i& block_L,
                                const FusionRules& rules) {
  constexpr float kHalf = 0.5f * static_cast<float>(kBlockSide);
  const Vec3f middle = toFloat(firstVoxelOfBlock(block_L)) + Vec3f{kHalf, kHalf, kHalf};
  return depthWeight(frame.voxel_size_m * rotateInverse(frame.T_L_C, middle - frame.T_L_C.t).z,
                     rules);
}

/// A frame's sums for a voxel, converted to floats.
struct RoundedSums {
  float weighted_sdf, weight;
  float dither;      ///< Pseudo-random, in [0, 1), so that rounding is unbiased.
  uint32_t nearest;  ///< Key of the nearest point; 0 if there is none.
};

/// A pseudo-random number in [0, 1): a hash of the sums, so it is the same on every backend.
DTSDF_HD float ditherOf(const VoxelSums& sums) {
  const uint32_t bits = (static_cast<uint32_t>(sums.weight) * 0x9e3779b1u ^
                         static_cast<uint32_t>(sums.weighted_sdf)) *
                        0x85ebca6bu;
  return static_cast<float>(static_cast<int32_t>(bits >> 24)) * (1.0f / 256.0f);
}

DTSDF_HD RoundedSums roundSums(const VoxelSums& sums) {
  return {static_cast<float>(sums.weighted_sdf), static_cast<float>(sums.weight), ditherOf(sums),
          sums.nearest};
}

/// Weight of a point in the mean that yields an anchor, from its squared distance to the corner's
/// foot; nearer points count more.
DTSDF_HD float anchorWeight(float squared_distance) {
  constexpr float kFarthest = 15.0f / 16.0f;
  const float closeness = 1.0f - minimum(sqrtf(maximum(squared_distance, 0.0f)), kFarthest);
  return closeness * closeness;
}

/// The anchor after a frame with distance `sdf` and a weight in units of 2^-16: the weighted mean
/// of the frames' nearest points. If this frame has no nearest point, the anchor does not change.
DTSDF_HD uint16_t foldAnchor(const Voxel& voxel, float sdf, float weight, const RoundedSums& sums) {
  const Vec3f point = pointOffset(sums.nearest), anchor = anchorOffset(voxel.anchor);
  const float from_foot = dot(anchor, anchor) - sdfOf(voxel) * sdfOf(voxel);
  const float old_weight = weightOf(voxel) * anchorWeight(from_foot);
  const float new_weight =
      weight * (1.0f / kStoredWeightScale) * anchorWeight(dot(point, point) - sdf * sdf);
  const float share = new_weight / (old_weight + new_weight);
  const auto has_none = static_cast<float>(static_cast<int32_t>(voxel.anchor == kNoAnchor));
  const auto mean = [&](float of_anchor, float of_point) {
    return (1.0f - has_none) * (of_anchor + share * (of_point - of_anchor)) + has_none * of_point;
  };
  const int32_t folded = packAnchor(
      {mean(anchor.x, point.x), mean(anchor.y, point.y), mean(anchor.z, point.z)}, sums.dither);
  const int32_t keeps = -static_cast<int32_t>(sums.nearest == 0);
  return static_cast<uint16_t>((voxel.anchor & keeps) | (folded & ~keeps));
}

/// The fold of the paper's two-pass scheme: D = (W D + w d) / (W + w), W = min(W + w, max). d is
/// the mean of the frame's distances. The frame's weight w is the fraction of the voxel that the
/// frame covers, at most 1, times the depth weight. Branch-free, for vectorisation. @pre
/// sums.weight > 0.
DTSDF_HD Voxel foldRoundedSums(const Voxel& voxel, const RoundedSums& sums, float depth_weight,
                               const FusionSettings& fusion) {
  const float covered = sums.weight / kWeightScale;  // fraction of the voxel; may exceed 1
  const float sdf = sums.weighted_sdf / (sums.weight * kSdfScale) * fusion.truncation_voxels;
  const float weight = maximum(minimum(covered, 1.0f) * depth_weight * kStoredWeightScale, 1.0f);
  const auto added = static_cast<int32_t>(weight + 0.5f);
  const auto before = static_cast<int32_t>(weightUnits(voxel));
  const auto most = static_cast<int32_t>(fusion.max_weight * kStoredWeightScale);
  const int32_t total = before + added;
  const float share = static_cast<float>(added) / static_cast<float>(total);
  const float mean = sdfOf(voxel) + share * (sdf - sdfOf(voxel));
  // Distances beyond support_reach come from noisy points, which update samples farther away. They
  // are averaged, but do not count as evidence.
  const bool supports =
      (covered >= fusion.rules.support_share) & (fabsf(sdf) <= fusion.support_reach);
  const int32_t evidence =
      select(supports, supportedEvidence(evidenceOf(voxel), fusion.rules), evidenceOf(voxel));
  return makeVoxel(storedSdf(mean, sums.dither), foldAnchor(voxel, sdf, weight, sums),
                   static_cast<uint32_t>(select(total < most, total, most)), evidence);
}

/// Folds a frame's sums; sums of weight 0 leave the voxel unchanged.
DTSDF_HD Voxel foldSums(const Voxel& voxel, const VoxelSums& sums, float depth_weight,
                        const FusionSettings& fusion) {
  if (sums.weight == 0) return voxel;
  return foldRoundedSums(voxel, roundSums(sums), depth_weight, fusion);
}

}  // namespace dtsdf
