/// Whether there is a surface: evidence, a counter of frames.
///
/// A frame that covers enough of a voxel supports the surface there. One that does not cover it,
/// but looks through the place where the voxel says the surface is, contradicts it (free_space.h).
/// All others say nothing.
///
/// The counter saturates: how near, and how long, a thing was seen does not matter to how fast it
/// goes when it is gone. (As the inlier ratio of Dong et al., "PSDF Fusion", ECCV 2018, and the
/// clamped log-odds of Hornung et al., "OctoMap", 2013, but in whole frames.)
#pragma once

#include "kernels/core/voxel.h"
#include "kernels/fusion/fusion_settings.h"

namespace dtsdf {

/// Evidence after a frame that supports a surface.
DTSDF_HD int32_t supportedEvidence(int32_t evidence, const FusionRules& rules) {
  const int32_t more = evidence + rules.support_gain;
  return more < rules.most_evidence ? more : rules.most_evidence;
}

/// A voxel after so many frames that contradict it. Without evidence nothing is left of it.
DTSDF_HD Voxel contradictedVoxel(const Voxel& voxel, int32_t frames, const FusionRules& rules) {
  const int32_t evidence = evidenceOf(voxel) - frames * rules.contradiction_cost;
  if (evidence <= 0) return makeVoxel(0.0f, 0, 0);
  return makeVoxel(voxel.sdf_units, voxel.anchor, weightUnits(voxel), evidence);
}

/// The least evidence of a surface that so many frames have supported, but for one that contradicts
/// each of them: what the mesh shows. Frames beyond those that were fused are not asked for.
DTSDF_HD int32_t leastEvidence(int32_t min_support, uint64_t fused_frames,
                               const FusionRules& rules) {
  const int32_t support =
      fused_frames < static_cast<uint64_t>(min_support) ? static_cast<int32_t>(fused_frames)
                                                        : min_support;
  const int32_t least = (support - 1) * rules.support_gain + 1;
  return least < 1 ? 1 : (least < rules.most_evidence ? least : rules.most_evidence);
}

}  // namespace dtsdf
