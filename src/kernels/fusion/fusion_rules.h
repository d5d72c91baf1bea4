/// The numbers of the rules that fuse surfels into voxels: defaults, units, and why they are so.
#pragma once

namespace dtsdf {

struct FusionRules {
  /// Samples farther than this from the measured plane, in voxels, are left alone: a mesh unit
  /// reaches no farther than sqrt(3) voxels from a surface in it, and more would only blur other
  /// surfaces. (docs/results/ablation.md: with the truncation of 4 voxels and equal weights the
  /// errors of vertices are four to five times as large.)
  float sample_reach = 1.75f;
  /// Where noise is wider than that, in standard deviations: measurements have to reach farther, or
  /// outliers do not average with the surface but form shells of their own. 2.5 deviations hold all
  /// but 1.2 % of the measurements. (docs/results/ablation.md: armadillo with a Kinect's noise at
  /// 5 mm, vertices 4.43 mm without, 2.06 with.)
  float noise_reach = 2.5f;

  /// What a frame says for free space, as a share of the weight of the pixels that cover the voxel:
  /// a surface there would give it some three times as much, so that what is taken away wrongly
  /// comes back. (docs/results/ablation.md has what it brings; the share itself is by judgement.)
  float free_share = 0.1f;
  /// A weight falls below 0 by so many times what one frame says at most: a thing that is put where
  /// space was free appears after some frames, if it is seen from about as near. By judgement.
  float most_free_frames = 10.0f;
  /// Depth in metres below which a voxel is not covered by more and more pixels: near the camera
  /// their number has no bound. By judgement: about where depth cameras begin to measure.
  float nearest_free_m = 0.5f;
  /// Distance of free space from what was measured beyond the reach of samples, in standard
  /// deviations of the noise: all but 0.3 % of the measurements lie nearer to the surface.
  float free_noise = 3.0f;
};

}  // namespace dtsdf
