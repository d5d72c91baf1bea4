/// Constants of the rules that paint surfaces: defaults, units and reasons.
#pragma once

#include <cstdint>

namespace dtsdf {

struct ColourRules {
  /// Maximum distance of voxels from the surface that they represent, in voxels. They are painted,
  /// and hide what is behind. It is over 0.5, so that each place of a surface has such a voxel.
  float surface_distance = 0.6f;
  /// Minimum difference in depth between a point's surface and another one, in voxels. Smaller
  /// differences are due to the roughness of the surface.
  float hidden_depth = 2.0f;

  /// Side of the squares that pixels are averaged over, in voxels. Finer detail is lost in the map
  /// anyway, and would appear as noise.
  float sample_width = 0.5f;
  /// Largest weight of a colour, in views as good as the newest, so that later views go on
  /// counting.
  int32_t max_views = 8;

  /// Minimum number of painted voxels for estimating an image's exposure: a small part of an image,
  /// by judgement.
  int32_t min_overlap = 256;
};

/// The settings that the rules of painting need.
struct PaintSettings {
  int32_t directional;
  int32_t fixed_exposure;     ///< 1: the image's values are used unchanged.
  float max_depth_m;          ///< Maximum depth of surfaces that are painted and hide others.
  float full_weight_depth_m;  ///< FusionRules::full_weight_depth_m; weights fall as z^-2 beyond it.
  ColourRules rules;
};

}  // namespace dtsdf
