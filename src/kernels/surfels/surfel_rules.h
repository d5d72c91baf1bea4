/// The numbers of the rules that turn an image into surfels: defaults, units, and why they are so.
/// What a measurement chose names it; "by judgement" says that none did.
///
/// A plane predicts a pixel that is off by no more than noise_level deviations, which noise
/// explains, and a voxel, within which the map does not tell surfaces apart.
#pragma once

namespace dtsdf {

struct SurfelRules {
  /// So many standard deviations are noise, of a difference those of a difference.
  float noise_level = 3.0f;

  /// A steep surface goes on in line with a step that differs by no more than this share: sides two
  /// pixels wide end in steps of which one is half as large at least.
  float linked_turn = 0.5f;
  /// A surface that curves out of sight ends with a step of at most this share of the jump behind
  /// it. One in ten mixed pixels lies that near to the front, and makes a tenth of the bridge.
  float linked_rim_share = 0.1f;

  /// Noise that pixels of a window share may raise the estimate to so many times what differs over
  /// three pixels: over seven, averaged, twice.
  float largest_shared_noise = 3.0f;

  /// Half width of the window that normals are fitted in, in voxels: finer detail is lost in the
  /// map anyhow, and more samples mean less noise.
  float window_voxels = 0.75f;
  /// Noise turns a normal by about this at most, in radians, as far as the window may grow.
  float largest_noise_turn = 0.15f;
  /// Share of the weight of a surfel that rests on a single line of pixels: enough where nothing
  /// else was measured, too little to disturb what was.
  float strip_weight = 0.05f;

  /// Widest square of merged pixels, in voxels: less than half, so that their samples are nearly
  /// those of one.
  float merged_width = 0.45f;
  /// Largest turn of the surface from one side of the square to the other, in radians: at a crease
  /// the pixels keep their own normals.
  float merged_turn = 1.0f;
};

}  // namespace dtsdf
