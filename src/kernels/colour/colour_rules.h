/// The numbers of the rules that paint surfaces: defaults, units, and why they are so.
#pragma once

#include <cstdint>

namespace dtsdf {

struct ColourRules {
  /// Voxels no farther from their surface than this show it, in voxels: they are painted, and hide
  /// what is behind. More than half, so that there is one for each place of the surface.
  float surface_distance = 0.6f;
  /// What is off a point's surface by more than this is another surface, in voxels: less is the
  /// roughness of the surface itself.
  float hidden_depth = 2.0f;

  /// Pixels are averaged over squares of about this side, in voxels: finer detail is lost in the
  /// map anyhow, and would show as noise.
  float sample_width = 0.5f;
  /// Views that a colour is the mean of, at most, by weight: what is seen as well later goes on
  /// counting.
  int32_t most_views = 8;

  /// The exposure of an image is judged where the map is painted already, from so many voxels on:
  /// by judgement, a small part of an image.
  int32_t least_overlap = 256;
};

/// What the rules that paint need to know of the settings, and of fusion.
struct PaintSettings {
  int32_t directional;
  int32_t fixed_exposure;     ///< Images are taken as they are.
  float max_depth_m;          ///< Up to which surfaces are painted, and hide others.
  float full_weight_depth_m;  ///< That of fusion: a view from farther away counts less, by z^-2.
  ColourRules rules;
};

}  // namespace dtsdf
