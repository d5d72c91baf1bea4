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
  return depthWeight(
      frame.voxel_size_m * rotateInverse(frame.T_L_C, middle - frame.T_L_C.t).z, rules);
}

/// D = (W D + w d) / (W + w), W = min(W + w, max), the fold of the paper's two-pass scheme, where d
/// is the mean of the frame's distances, and its weight w is the share of the voxel that it covers,
/// 1 at most, times its weight by depth. Sums of weight 0 leave the voxel alone.
DTSDF_HD Voxel foldSums(const Voxel& voxel, const VoxelSums& sums, float depth_weight,
                        const FusionSettings& fusion) {
  if (sums.weight == 0) return voxel;
  const float covered = static_cast<float>(sums.weight) / kWeightScale;
  const float sdf = static_cast<float>(sums.weighted_sdf) /
                    (static_cast<float>(sums.weight) * kSdfScale) * fusion.truncation_voxels;
  const float share = minimum(covered, 1.0f) * depth_weight * kStoredWeightScale;
  const uint32_t added = static_cast<uint32_t>(maximum(share, 1.0f) + 0.5f);
  const uint32_t before = weightUnits(voxel), total = before + added;
  const auto most = static_cast<uint32_t>(fusion.max_weight * kStoredWeightScale);
  const float mean = (static_cast<float>(before) * voxel.sdf + static_cast<float>(added) * sdf) /
                     static_cast<float>(total);
  const int32_t evidence = covered >= fusion.rules.support_share
                               ? supportedEvidence(evidenceOf(voxel), fusion.rules)
                               : evidenceOf(voxel);
  return makeVoxel(mean, total < most ? total : most, evidence);
}

}  // namespace dtsdf
