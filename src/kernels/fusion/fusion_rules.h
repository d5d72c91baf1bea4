/// Constants of the rules that fuse surfels into voxels: defaults, units and reasons.
#pragma once

#include <cstdint>

#include "kernels/surfels/surfel_rules.h"

namespace dtsdf {

struct FusionRules {
  /// Distance from the measured plane, in voxels, within which samples are updated. A mesh unit
  /// reaches no farther than sqrt(3) voxels from a surface in it, and farther samples would only
  /// blur other surfaces. (docs/results/ablation.md: with the truncation of 4 voxels and equal
  /// weights, the errors of vertices are four to five times as large.) A frame does not support
  /// surfaces farther from its own either. (The same page: if it does, the errors of vertices are a
  /// quarter larger with a stereo camera's noise at 5 mm.)
  float sample_reach = 1.75f;
  /// The same where noise is wider, in standard deviations: measurements have to reach farther, or
  /// outliers form shells of their own instead of averaging with the surface. 2.5 deviations
  /// include all but 1.2 % of the measurements. (docs/results/ablation.md: armadillo with a
  /// Kinect's noise at 5 mm, vertices 4.43 mm without, 2.06 with.)
  float noise_reach = 2.5f;

  /// Depth in metres up to which a frame has full weight; beyond it the weight falls as z^-2. The
  /// noise of triangulation grows with z^2, and a weight is the inverse of a standard deviation.
  /// (The authors' later work uses the sensor's smallest depth in place of 1 m.)
  float full_weight_depth_m = 1.0f;

  /// Minimum share of a voxel that a frame must cover to support the surface there. A smaller share
  /// comes from the far fringe of a surfel, or from a measurement with little trust. (Held-back
  /// images of box at 5 mm, in front of what was measured: 5.1 % without, 1.8 with 0.0003. That
  /// value makes holes in a floor at a grazing angle, though, and 0.0015 costs the dragon at 10 mm
  /// a quarter of its completeness.)
  float support_share = 0.0001f;
  /// Evidence that a frame adds by supporting a surface.
  int32_t support_gain = 3;
  /// Evidence that a frame takes away by contradicting a surface. So a surface that half of the
  /// frames see through stays, and one that two of three see through goes. (Held-back images, in
  /// front of what was measured, with 1 / 2 / 3: cabinet at 20 mm 1.76 / 1.66 / 1.50 %, behind 1.03
  /// / 1.15 / 1.44 %.)
  int32_t contradiction_cost = 2;
  /// Largest evidence, of a surface and, below zero, of free space: fusion/memory_frames supports.
  /// With eight, a removed object is gone after twelve frames that see through it, and a new one
  /// shows after ten, however long it was there or its place was free. With nineteen these are 30
  /// (blocks are checked in turns) and 21.
  int32_t max_evidence{24};  // not set directly: follows from the setting

  /// Distance in voxels that free space keeps from a measured surface, in addition to its noise.
  float free_margin = 0.5f;
  /// Blocks in view that a frame does not touch, and voxels without a distance, are checked in one
  /// of this many frames; each check counts for all of them.
  int32_t look_turns = 4;
};

/// The settings that the rules of fusion need.
struct FusionSettings {
  int32_t cast_along_normal;  ///< 0: along the view ray.
  int32_t directional;
  float truncation_voxels;
  float max_weight;
  FusionRules rules;
  /// SurfelRules::noise_level, as used to make the surfels.
  float noise_level = SurfelRules().noise_level;
  /// Distance from a frame's own surface within which it supports one, in voxels.
  float support_reach = FusionRules().sample_reach;
};

}  // namespace dtsdf
