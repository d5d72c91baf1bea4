/// Parameters of the rules that fuse surfels into voxels, with their default values and the reasons
/// for them.
#pragma once

#include <cstdint>

#include "kernels/surfels/surfel_rules.h"

namespace dtsdf {

struct FusionRules {
  /// Distance from the measured plane, in voxels, within which samples are updated and a frame
  /// supports a surface; voxel projection uses the truncation instead. No corner of a mesh unit is
  /// farther than sqrt(3) voxels from a surface in the unit; samples beyond that distance would
  /// only blur other surfaces (docs/results/ablation.md, Support only from near surfaces).
  float sample_reach = 1.75f;
  /// Noisy points update samples up to this distance, in standard deviations of their depth, if
  /// that is more than sample_reach. Samples beyond sample_reach support no surface. Without this
  /// rule, outliers would form separate shells instead of averaging with the surface. 2.5
  /// deviations include all but 1.2 % of the measurements.
  float noise_reach = 2.5f;

  /// Depth in metres up to which a frame has full weight; beyond it the weight falls as z^-2, like
  /// the inverse of the standard deviation of triangulated depth. (The authors' later work uses the
  /// sensor's smallest depth in place of 1 m.)
  float full_weight_depth_m = 1.0f;

  /// Minimum fraction of a voxel that a frame must cover to support the surface there. Smaller
  /// fractions come from the far fringe of a surfel, or from a strip one pixel wide. (For the
  /// recording `box` at 5 mm, the mesh is in front of the measured depth in 5.1 % of the pixels of
  /// held-out images without this rule, and in 1.8 % with 0.0003. But 0.0003 causes holes in a
  /// floor at a grazing angle, and with 0.0015 a quarter of the dragon is missing at 10 mm.)
  float support_share = 0.0001f;
  /// Evidence that a frame adds by supporting a surface.
  int32_t support_gain = 3;
  /// Evidence that a frame removes by contradicting a surface. With 2, a surface stays if half of
  /// the frames look through it, and vanishes if two out of three do.
  int32_t contradiction_cost = 2;
  /// Largest magnitude of evidence: the evidence from fusion/memory_frames supports. With eight
  /// supports, a removed object vanishes within 12 frames that look through it, and a new object
  /// appears within 10 frames, whatever was there before. With nineteen, these are 28 frames (32 if
  /// a single frame suffices for the mesh) and 21 frames.
  int32_t max_evidence{24};  // follows from fusion/memory_frames

  /// Distance, in voxels, between free space and a measured surface, in addition to the allowance
  /// for noise.
  float free_margin = 0.5f;
  /// Voxels that a frame does not cover are checked in only one out of this many frames; each check
  /// counts this many times.
  int32_t look_turns = 4;
};

/// Settings for fusion.
struct FusionSettings {
  int32_t cast_along_normal;  ///< If 0, surfels are cast along the view ray.
  int32_t directional;
  float truncation_voxels;
  float max_weight;
  FusionRules rules;
  /// SurfelRules::noise_level, as used to compute the surfels.
  float noise_level = SurfelRules().noise_level;
  /// Largest distance, in voxels, at which a frame's mean distance supports a voxel's surface.
  float support_reach = FusionRules().sample_reach;
};

}  // namespace dtsdf
