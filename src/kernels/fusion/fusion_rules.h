/// Constants of the rules that fuse surfels into voxels: defaults, units and reasons.
#pragma once

#include <cstdint>

#include "kernels/surfels/surfel_rules.h"

namespace dtsdf {

struct FusionRules {
  /// Distance from the measured plane, in voxels, within which samples are updated and a frame
  /// supports a surface; voxel projection uses the truncation instead. A mesh unit reaches no
  /// farther than sqrt(3) voxels from a surface in it; farther samples would only blur other
  /// surfaces (docs/results/ablation.md, Support only from near surfaces).
  float sample_reach = 1.75f;
  /// Distance within which the samples of noisy points are updated, in standard deviations of their
  /// depth, if that is more than sample_reach; beyond sample_reach they support no surface. Without
  /// this, outliers would form shells of their own instead of averaging with the surface. 2.5
  /// deviations include all but 1.2 % of the measurements.
  float noise_reach = 2.5f;

  /// Depth in metres up to which a frame has full weight; beyond it the weight falls as z^-2, like
  /// the inverse standard deviation of triangulated depth. (The authors' later work uses the
  /// sensor's smallest depth in place of 1 m.)
  float full_weight_depth_m = 1.0f;

  /// Minimum share of a voxel that a frame must cover to support the surface there. A smaller share
  /// comes from the far fringe of a surfel, or from a strip. (For box at 5 mm, the mesh is in front
  /// of the measured depth in 5.1 % of the pixels of held-out images without this rule, and in 1.8
  /// % with 0.0003. But 0.0003 makes holes in a floor at a grazing angle, and 0.0015 costs the
  /// dragon at 10 mm a quarter of its completeness.)
  float support_share = 0.0001f;
  /// Evidence that a frame adds by supporting a surface.
  int32_t support_gain = 3;
  /// Evidence that a frame takes away by contradicting a surface. So a surface stays if half of the
  /// frames see through it, and vanishes if two out of three do.
  int32_t contradiction_cost = 2;
  /// Largest magnitude of evidence: that of fusion/memory_frames supports. With eight of them, a
  /// removed object vanishes within 12 frames that see through it, and a new one appears after 10,
  /// whatever was there before. With nineteen, an object vanishes within 28 frames (32 if a single
  /// frame suffices for the mesh), and a new one appears after 21.
  int32_t max_evidence{24};  // follows from fusion/memory_frames

  /// Distance in voxels that free space keeps from a measured surface, in addition to its noise.
  float free_margin = 0.5f;
  /// Voxels that a frame does not cover are checked in only one out of this many frames; each check
  /// counts for all of them.
  int32_t look_turns = 4;
};

/// Settings of the fusion rules.
struct FusionSettings {
  int32_t cast_along_normal;  ///< If 0, surfels are cast along the view ray.
  int32_t directional;
  float truncation_voxels;
  float max_weight;
  FusionRules rules;
  /// SurfelRules::noise_level, as used to make the surfels.
  float noise_level = SurfelRules().noise_level;
  /// Largest distance, in voxels, at which a frame's measurements support a voxel's surface.
  float support_reach = FusionRules().sample_reach;
};

}  // namespace dtsdf
