/// Parameters of the rules that compute surfels from an image, with their default values and the
/// reasons for them.
#pragma once

namespace dtsdf {

struct SurfelRules {
  /// Number of standard deviations up to which a difference is attributed to noise.
  float noise_level = 3.0f;

  /// Largest change from one step (see links.h) of a steep surface to the next step in line, as a
  /// fraction of the step. A surface two pixels wide has one full step between two partial steps,
  /// one of which is at least half as large.
  float linked_turn = 0.5f;
  /// Largest final step of a surface that curves out of sight, as a fraction of the jump behind it.
  /// By chance, one mixed pixel in ten is that close to the surface in front.
  float linked_rim_share = 0.1f;

  /// Largest factor by which lines with steps of seven pixels may raise the estimate of the noise.
  /// These lines reveal noise that is correlated between neighbouring pixels: if a sensor averages
  /// depth over seven pixels, the factor is two.
  float largest_shared_noise = 3.0f;

  /// Half width of the window in which normals are fitted, in voxels. Finer detail is lost in the
  /// map anyway, and more samples mean less noise.
  float window_voxels = 0.75f;
  /// Largest standard deviation of a normal's angle due to noise, in radians. The window grows to
  /// achieve it, up to its limit.
  float largest_noise_turn = 0.15f;
  /// Weight factor for surfels from strips one pixel wide. It suffices where nothing else is
  /// measured, but is too small to disturb other measurements.
  float strip_weight = 0.05f;

  /// Largest width of a square of merged pixels, in voxels. Below half a voxel, the pixels update
  /// nearly the same samples.
  float merged_width = 0.45f;
  /// Largest turn of the surface across a merged square, in radians; pixels at a crease keep their
  /// own normals.
  float merged_turn = 1.0f;
};

}  // namespace dtsdf
