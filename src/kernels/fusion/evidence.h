/// Evidence: a counter per voxel that decides whether there is a surface.
///
/// A frame that measures the voxel's surface supports it (voxel_update.h). A frame that looks
/// through the voxel's place (defined in free_space.h) contradicts the voxel. Frames count even
/// where there is no surface: a negative counter is evidence of free space.
///
/// The counter saturates at both ends. This limits the number of frames after which a removed
/// object disappears, or a new object appears, no matter how long the previous state lasted.
/// (Similar to the inlier ratio of Dong et al., "PSDF Fusion", ECCV 2018, and the clamped log-odds
/// of Hornung et al., "OctoMap", 2013, but it counts whole frames.)
#pragma once

#include "kernels/core/voxel.h"
#include "kernels/fusion/fusion_rules.h"

namespace dtsdf {

/// Evidence after one more frame that supports the surface.
DTSDF_HD int32_t supportedEvidence(int32_t evidence, const FusionRules& rules) {
  const int32_t more = evidence + rules.support_gain;
  return more < rules.max_evidence ? more : rules.max_evidence;
}

/// Whether a voxel's evidence is so close to the maximum that a further support would not count in
/// full.
DTSDF_HD bool isFull(const Voxel& voxel, const FusionRules& rules) {
  return evidenceOf(voxel) + rules.support_gain > rules.max_evidence;
}

/// A voxel after `frames` contradictions. If the frame covers the voxel (`is_covered`), a support
/// is also revoked, whether or not the frame has added one. A voxel without positive evidence loses
/// its distance.
DTSDF_HD Voxel contradictedVoxel(const Voxel& voxel, int32_t frames, bool is_covered,
                                 const FusionRules& rules) {
  const int32_t cost = frames * rules.contradiction_cost + (is_covered ? rules.support_gain : 0);
  const int32_t less = evidenceOf(voxel) - cost;
  if (less > 0) return makeVoxel(voxel.sdf_units, voxel.anchor, weightUnits(voxel), less);
  return makeVoxel(0.0f, 0, less > -rules.max_evidence ? less : -rules.max_evidence);
}

/// Minimum evidence required for a surface to be meshed. It exceeds the evidence from min_support -
/// 1 supports, so that min_support frames are needed; it is at least 1 and at most max_evidence. If
/// fewer than min_support frames have been fused, all of them must support the surface.
DTSDF_HD int32_t minEvidence(int32_t min_support, uint64_t fused_frames, const FusionRules& rules) {
  const int32_t support = fused_frames < static_cast<uint64_t>(min_support)
                              ? static_cast<int32_t>(fused_frames)
                              : min_support;
  const int32_t least = (support - 1) * rules.support_gain + 1;
  return least < 1 ? 1 : (least < rules.max_evidence ? least : rules.max_evidence);
}

}  // namespace dtsdf
