/// Whether there is a surface: evidence, a counter of frames.
///
/// A frame that covers enough of a voxel, near its own surface, supports the surface there, unless
/// it sees the outline short of it. One that looks through the place where the voxel says the
/// surface is contradicts it (free_space.h). All others say nothing.
///
/// Frames count before there is a surface as well: below zero the counter is evidence of free
/// space. So a surface that some frames measured where others see through, since poses or outlines
/// are off, is weighed against all of them, and not only against those that came after.
///
/// The counter saturates at both ends: how near, and how long, a thing was seen does not matter to
/// how fast it goes when it is gone, nor how long a place was free to how fast a thing appears. (As
/// the inlier ratio of Dong et al., "PSDF Fusion", ECCV 2018, and the clamped log-odds of Hornung
/// et al., "OctoMap", 2013, but in whole frames.)
#pragma once

#include "kernels/core/voxel.h"
#include "kernels/fusion/fusion_rules.h"

namespace dtsdf {

/// Evidence after a frame that supports a surface.
DTSDF_HD int32_t supportedEvidence(int32_t evidence, const FusionRules& rules) {
  const int32_t more = evidence + rules.support_gain;
  return more < rules.most_evidence ? more : rules.most_evidence;
}

/// Whether a voxel has so much evidence of a surface that a support does not count in full.
DTSDF_HD bool isFull(const Voxel& voxel, const FusionRules& rules) {
  return evidenceOf(voxel) + rules.support_gain > rules.most_evidence;
}

/// A voxel after so many frames that contradict it. One that covers it as well costs a support
/// more, whether it has given one or not. Without evidence of a surface no distance
/// is left.
DTSDF_HD Voxel contradictedVoxel(const Voxel& voxel, int32_t frames, bool is_covered,
                                 const FusionRules& rules) {
  const int32_t cost = frames * rules.contradiction_cost + (is_covered ? rules.support_gain : 0);
  const int32_t less = evidenceOf(voxel) - cost;
  if (less > 0) {
    Voxel r = makeVoxel(voxel.sdf_units, voxel.anchor, weightUnits(voxel), less);
    r.outline = voxel.outline;
    return r;
  }
  return makeVoxel(0.0f, 0, less > -rules.most_evidence ? less : -rules.most_evidence);
}

/// The least evidence of a surface that so many frames have supported, but for one that contradicts
/// each of them: what the mesh shows. Frames beyond those that were fused are not asked for.
DTSDF_HD int32_t leastEvidence(int32_t min_support, uint64_t fused_frames,
                               const FusionRules& rules) {
  const int32_t support = fused_frames < static_cast<uint64_t>(min_support)
                              ? static_cast<int32_t>(fused_frames)
                              : min_support;
  const int32_t least = (support - 1) * rules.support_gain + 1;
  return least < 1 ? 1 : (least < rules.most_evidence ? least : rules.most_evidence);
}

}  // namespace dtsdf
