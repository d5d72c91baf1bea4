/// The numbers of the rules that fuse surfels into voxels: defaults, units, and why they are so.
#pragma once

#include <cstdint>

#include "kernels/surfels/surfel_rules.h"

namespace dtsdf {

struct FusionRules {
  /// Samples farther than this from the measured plane, in voxels, are left alone: a mesh unit
  /// reaches no farther than sqrt(3) voxels from a surface in it, and more would only blur other
  /// surfaces. (docs/results/ablation.md: with the truncation of 4 voxels and equal weights the
  /// errors of vertices are four to five times as large.) Nor does a frame support a surface that
  /// it measures farther away. (The same page: with a stereo camera's noise at 5 mm the errors of
  /// vertices are a quarter larger if it does.)
  float sample_reach = 1.75f;
  /// Where noise is wider than that, in standard deviations: measurements have to reach farther, or
  /// outliers do not average with the surface but form shells of their own. 2.5 deviations hold all
  /// but 1.2 % of the measurements. (docs/results/ablation.md: armadillo with a Kinect's noise at
  /// 5 mm, vertices 4.43 mm without, 2.06 with.)
  float noise_reach = 2.5f;

  /// Depth in metres up to which a frame has the full weight; beyond, its weight falls as z^-2. The
  /// noise of triangulation grows with z^2, and a weight is the inverse of a standard deviation.
  /// (The authors' later work has the sensor's nearest depth in place of 1 m.)
  float full_weight_depth_m = 1.0f;

  /// Share of a voxel that a frame has to cover to support the surface there: below it is what the
  /// far fringe of a surfel reaches, and what is trusted little. (Held-back images of box at 5 mm,
  /// in front of what was measured: 5.1 % without, 1.8 with 0.0003. That, though, makes holes in a
  /// floor at a grazing angle, and 0.0015 costs the dragon at 10 mm a quarter of its completeness.)
  float support_share = 0.0001f;
  /// Evidence that a frame adds by supporting a surface, ...
  int32_t support_gain = 3;
  /// ... and takes away by contradicting it: a surface that is seen through as often as not stays,
  /// one that is seen through in two frames of three goes. (Held-back images, in front of what was
  /// measured, with 1 / 2 / 3: cabinet at 20 mm 1.76 / 1.66 / 1.50 %, behind 1.03 / 1.15 / 1.44 %.)
  int32_t contradiction_cost = 2;
  /// The most evidence, of a surface and, below zero, of free space: fusion/memory_frames supports.
  /// With eight, what is taken away is gone after twelve frames that see through it, however long
  /// it was there, and what appears is shown after ten, however long the place was free; with
  /// nineteen after 30, as those are looked at in turns, and 21.
  int32_t most_evidence{24};  // no number to set: the setting decides it

  /// Distance of free space from what was measured, in voxels, besides what noise explains.
  float free_margin = 0.5f;
  /// Blocks in view that a frame does not touch, and voxels without a distance, are looked at in
  /// turns, in one of so many frames; such a look counts for all of them.
  int32_t look_turns = 4;
};

/// What the rules of fusion need to know of the settings.
struct FusionSettings {
  int32_t cast_along_normal;  ///< Else along the view ray.
  int32_t directional;
  float truncation_voxels;
  float max_weight;
  FusionRules rules;
  /// So many standard deviations are noise, here as where surfels are made.
  float noise_level = SurfelRules().noise_level;
  /// So near to its own surface a frame supports one, in voxels.
  float support_reach = FusionRules().sample_reach;
};

}  // namespace dtsdf
