/// Constants of the rules that make surfels from an image: defaults, units and reasons. A
/// measurement behind a value is named; "by judgement" means that there is none.
///
/// A plane predicts a pixel to within noise_level deviations of noise plus a voxel, within which
/// the map does not separate surfaces.
#pragma once

namespace dtsdf {

struct SurfelRules {
  /// Standard deviations that count as noise; for a difference, those of the difference.
  float noise_level = 3.0f;

  /// Largest difference from one step of a steep surface to the next in line, as a share of the
  /// step. Sides two pixels wide end in steps of which one is at least half as large.
  float linked_turn = 0.5f;
  /// Largest final step of a surface that curves out of sight, as a share of the jump behind it.
  /// One in ten mixed pixels is that near to the front, and spans a tenth of the jump.
  float linked_rim_share = 0.1f;

  /// Noise shared by the pixels of a window may raise the estimate to this multiple of that over
  /// three pixels. Averaging over seven pixels gives a factor of two.
  float largest_shared_noise = 3.0f;

  /// Half width of the window that normals are fitted in, in voxels. Finer detail is lost in the
  /// map anyway, and more samples mean less noise.
  float window_voxels = 0.75f;
  /// Maximum angle that noise may turn a normal by, in radians; the window grows for it up to its
  /// limit.
  float largest_noise_turn = 0.15f;
  /// Factor of the weight of a surfel from a single line of pixels: enough if nothing else was
  /// measured, too little to disturb what was.
  float strip_weight = 0.05f;

  /// Largest width of a square of merged pixels, in voxels: less than half, so that their samples
  /// are nearly the same.
  float merged_width = 0.45f;
  /// Largest turn of the surface across the square, in radians: at a crease the pixels keep their
  /// own normals.
  float merged_turn = 1.0f;
};

}  // namespace dtsdf
