/// Evidence: a counter per voxel that decides whether there is a surface.
///
/// A frame that measures the voxel's surface supports it (voxel_update.h). A frame that looks
/// through the voxel's place contradicts it (free_space.h). Frames count even before there is a
/// surface: below zero, the counter is evidence of free space.
///
/// The counter saturates at both ends. So the number of frames after which a removed object
/// disappears, or a new one appears, is limited, no matter how many frames showed the opposite
/// before. (Similar to the inlier ratio of Dong et al., "PSDF Fusion", ECCV 2018, and the clamped
/// log-odds of Hornung et al., "OctoMap", 2013, but it counts whole frames.)
#pragma once

#include "kernels/core/voxel.h"
#include "kernels/fusion/fusion_rules.h"

namespace dtsdf {

/// Evidence after one more frame that supports the surface.
DTSDF_HD int32_t supportedEvidence(int32_t evidence, const FusionRules& rules) {
  const int32_t more = evidence + rules.support_gain;
  return more < rules.max_evidence ? more : rules.max_evidence;
}

/// Whether a voxel's evidence is so close to the maximum that a support does not count in full.
DTSDF_HD bool isFull(const Voxel& voxel, const FusionRules& rules) {
  return evidenceOf(voxel) + rules.support_gain > rules.max_evidence;
}

/// A voxel after `frames` contradictions. A frame that covers the voxel also takes back a support,
/// whether or not it gave one. Without positive evidence the voxel loses its distance.
DTSDF_HD Voxel contradictedVoxel(const Voxel& voxel, int32_t frames, bool is_covered,
                                 const FusionRules& rules) {
  const int32_t cost = frames * rules.contradiction_cost + (is_covered ? rules.support_gain : 0);
  const int32_t less = evidenceOf(voxel) - cost;
  if (less > 0) return makeVoxel(voxel.sdf_units, voxel.anchor, weightUnits(voxel), less);
  return makeVoxel(0.0f, 0, less > -rules.max_evidence ? less : -rules.max_evidence);
}

/// Minimum evidence of a surface in the mesh. It exceeds that from min_support - 1 supports, so
/// min_support frames are needed; it is at least 1 and at most max_evidence. If fewer frames have
/// been fused, all of them must support the surface.
DTSDF_HD int32_t minEvidence(int32_t min_support, uint64_t fused_frames, const FusionRules& rules) {
  const int32_t support = fused_frames < static_cast<uint64_t>(min_support)
                              ? static_cast<int32_t>(fused_frames)
                              : min_support;
  const int32_t least = (support - 1) * rules.support_gain + 1;
  return least < 1 ? 1 : (least < rules.max_evidence ? least : rules.max_evidence);
}

}  // namespace dtsdf
