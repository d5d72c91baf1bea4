/// How the sums of a frame are folded into a voxel.
#pragma once

#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "kernels/fusion/evidence.h"

namespace dtsdf {

/// Weight of a frame by the depth of what it sees: min(1, (full_weight_depth_m / z)^2).
DTSDF_HD float depthWeight(float depth_m, const FusionRules& rules) {
  const float full_m = rules.full_weight_depth_m;
  return depth_m <= full_m ? 1.0f : full_m * full_m / (depth_m * depth_m);
}

/// The same for all voxels of a block, by the depth of its middle.
DTSDF_HD float blockDepthWeight(const FrameView& frame, const Vec3i& block_L,
                                const FusionRules& rules) {
  constexpr float kHalf = 0.5f * static_cast<float>(kBlockSide);
  const Vec3f middle = toFloat(firstVoxelOfBlock(block_L)) + Vec3f{kHalf, kHalf, kHalf};
  return depthWeight(frame.voxel_size_m * rotateInverse(frame.T_L_C, middle - frame.T_L_C.t).z,
                     rules);
}

/// What a frame's sums say of a voxel.
struct FrameSample {
  float sdf;         ///< Mean of the distances, in voxels.
  float covered;     ///< Share of the voxel that the frame's surfels cover, or more.
  float weight;      ///< That of the frame, in units of 2^-16.
  float dither;      ///< In [0, 1), as good as random, so that what is rounded is right on average.
  uint32_t nearest;  ///< Key of the nearest point; 0: none.
};

/// Scrambled bits of the sums: the same wherever they are computed.
DTSDF_HD float ditherOf(const VoxelSums& sums) {
  const uint32_t bits = (static_cast<uint32_t>(sums.weight) * 0x9e3779b1u ^
                         static_cast<uint32_t>(sums.weighted_sdf)) *
                        0x85ebca6bu;
  return static_cast<float>(static_cast<int32_t>(bits >> 24)) * (1.0f / 256.0f);
}

DTSDF_HD FrameSample sampleOfSums(const VoxelSums& sums, float depth_weight,
                                  const FusionSettings& fusion) {
  FrameSample sample;
  sample.covered = static_cast<float>(sums.weight) / kWeightScale;
  sample.sdf = static_cast<float>(sums.weighted_sdf) /
               (static_cast<float>(sums.weight) * kSdfScale) * fusion.truncation_voxels;
  const float share = minimum(sample.covered, 1.0f) * depth_weight * kStoredWeightScale;
  sample.weight = maximum(share, 1.0f);
  sample.dither = ditherOf(sums);
  sample.nearest = sums.nearest;
  return sample;
}

/// How much a point counts for an anchor, by its squared distance from the corner's foot: the
/// nearer, the more.
DTSDF_HD float anchorCloseness(float squared_distance) {
  constexpr float kFarthest = 15.0f / 16.0f;
  const float closeness = 1.0f - minimum(sqrtf(maximum(squared_distance, 0.0f)), kFarthest);
  return closeness * closeness;
}

/// The anchor after a frame: the mean of the points that were nearest in each, by how near they
/// were. So it comes to where the surface was seen from nearest by, and noise is averaged.
DTSDF_HD uint16_t foldAnchor(const Voxel& voxel, const FrameSample& frame) {
  if (frame.nearest == 0) return voxel.anchor;
  const Vec3f point = pointOffset(frame.nearest);
  if (voxel.anchor == kNoAnchor) return packAnchor(point, frame.dither);
  const Vec3f anchor = anchorOffset(voxel.anchor);
  const float from_foot = dot(anchor, anchor) - sdfOf(voxel) * sdfOf(voxel);
  const float old_weight = weightOf(voxel) * anchorCloseness(from_foot);
  const float new_weight = frame.weight * (1.0f / kStoredWeightScale) *
                           anchorCloseness(dot(point, point) - frame.sdf * frame.sdf);
  const float share = new_weight / (old_weight + new_weight);
  return packAnchor(anchor + share * (point - anchor), frame.dither);
}

/// D = (W D + w d) / (W + w), W = min(W + w, max), the fold of the paper's two-pass scheme, where d
/// is the mean of the frame's distances, and its weight w is the share of the voxel that it covers,
/// 1 at most, times its weight by depth. Sums of weight 0 leave the voxel alone.
DTSDF_HD Voxel foldSums(const Voxel& voxel, const VoxelSums& sums, float depth_weight,
                        const FusionSettings& fusion) {
  if (sums.weight == 0) return voxel;
  const FrameSample frame = sampleOfSums(sums, depth_weight, fusion);
  const uint32_t added = static_cast<uint32_t>(frame.weight + 0.5f);
  const uint32_t before = weightUnits(voxel), total = before + added;
  const auto most = static_cast<uint32_t>(fusion.max_weight * kStoredWeightScale);
  const float share = static_cast<float>(added) / static_cast<float>(total);
  const float mean = sdfOf(voxel) + share * (frame.sdf - sdfOf(voxel));
  const int32_t evidence = frame.covered >= fusion.rules.support_share
                               ? supportedEvidence(evidenceOf(voxel), fusion.rules)
                               : evidenceOf(voxel);
  return makeVoxel(storedSdf(mean, frame.dither), foldAnchor(voxel, frame),
                   total < most ? total : most, evidence);
}

}  // namespace dtsdf
