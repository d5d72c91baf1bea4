/// The numbers of the rules that turn an image into surfels: defaults, units, and why they are so.
/// What a measurement chose names it; "by judgement" says that none did.
#pragma once

#include <cstdint>

namespace dtsdf {

struct SurfelRules {
  /// So many deviations of the noise between neighbouring inverse depths do not part them.
  /// Three deviations of a difference.
  float linked_noise = 4.2f;
  /// Nor does a slope of the surface by which its depth grows by so many widths of a pixel from one
  /// to the next (63 degrees where the camera looks straight at it).
  float linked_slope = 2.0f;
  /// Nor does a difference of their depths by so many voxels: a bridge as short as that is no harm.
  /// (Completeness of the dragon at 10 mm 1.16 mm with 1, 1.01 with 1.5, 0.91 with 3; but bridges
  /// of mixed pixels 0.1 m before a wall, voxels of 20 mm: 7 % of a skirt with 1, 20 % with 2.)
  float linked_step = 1.5f;
  /// A steeper surface has to go on on one side at least, with a step that differs by no more than
  /// this share: sides two pixels wide end in steps of which one is half as large at least.
  float linked_turn = 0.5f;
  /// And with steps in the lines to both sides that differ by no more than this share. (Bridge of
  /// mixed pixels 0.1 m before a wall at 5 m, 20 mm voxels: 9.1 % with 0.3, 3.7 % with 0.2.)
  float linked_turn_beside = 0.2f;
  /// Or it ends there: a surface that curves out of sight does so by a step of at most this share
  /// of the jump behind it. One in ten mixed pixels lies that near to the front, and makes a tenth
  /// of the bridge. (Completeness at 5 mm, 100 images: bunny 0.74 mm without, 0.31 with; dragon
  /// 1.15 and 0.81.)
  float linked_rim_share = 0.1f;

  /// Between samples whose inverse depths differ by more than this share there is an edge, which is
  /// no noise. (Bridge of mixed pixels 0.2 m before a wall at 2.5 m, noise, 20 mm voxels: 12.9 % of
  /// a skirt with 0.1, 9.6 % with 0.07.)
  float noise_jump = 0.07f;
  /// Noise that neighbours share may raise the estimate to so many times what differs from pixel to
  /// pixel. (Completeness of the dragon at 10 mm 1.15 mm with 1, 1.00 with 3, with a slope of 4.)
  float largest_shared_noise = 3.0f;

  /// With fewer usable lines than this there is no telling an image's noise, and it counts as 0.
  /// The median of 32 variances with five degrees of freedom tells a deviation to some 15 %.
  int32_t least_noise_lines = 32;

  /// Half width of the window that normals are fitted in, in voxels: finer detail is lost in the
  /// map anyhow, and more samples mean less noise. (docs/results/ablation.md: 11 pixels everywhere
  /// instead raise the error of vertices by a quarter at 10 mm voxels.)
  float window_voxels = 0.75f;
  /// But no less than this, in pixels: by judgement, the least that has samples to average.
  float least_window_px = 2.0f;
  /// Noise turns a normal by about this at most, in radians, as far as the window may grow.
  /// (docs/results/ablation.md: vertices with a Kinect's noise 4.43 mm without the estimate of
  /// noise, 2.06 mm with it and this limit.)
  float largest_noise_turn = 0.15f;

  /// A normal that rests on a single line of pixels needs this many: any two lie on a line, so that
  /// a third is the first to confirm it.
  int32_t least_strip_px = 3;
  /// Share of the weight of such a surfel: enough where nothing else was measured, too little to
  /// disturb what was. (Completeness of house_noisy at 25 mm 5.69 mm without strips, 5.37 with.)
  float strip_weight = 0.05f;

  /// Widest square of merged pixels, in voxels: less than half, so that their samples are nearly
  /// those of one. (docs/results/ablation.md: errors as with single pixels, less work.)
  float merged_width = 0.45f;
  /// Largest difference of the depths of merged pixels, in voxels: by judgement.
  float merged_depth_range = 1.0f;
  /// Largest turn of the surface from one side of the square to the other, along the rows, in
  /// radians: at a crease the pixels have to keep their own normals. (Without it, completeness of
  /// the thin plates is 1.58 instead of 1.33 mm.)
  float merged_turn_across = 0.6f;
  /// The same down the columns, between single rows, where noise counts for more.
  float merged_turn_down = 1.2f;
  /// Rows over which the slope above and below the square is taken: by judgement, enough to average
  /// noise, and few enough not to reach creases farther away.
  int32_t merged_rows_beside = 3;

  /// A pixel that covers more of the surface than this, in voxels, is subdivided: its neighbours
  /// then leave samples between them out.
  float subdivided_width = 1.0f;
  /// It is subdivided only if its neighbours lie no farther from its plane than this, in voxels:
  /// one surface, not the step from one to another. (Without, vertices of the armadillo at 5 mm are
  /// off by 0.50 instead of 0.22 mm.)
  float subdivided_step = 0.5f;
};

}  // namespace dtsdf
