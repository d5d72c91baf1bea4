/// Constants of the rules that paint surfaces: defaults, units and reasons.
#pragma once

#include <cstdint>

namespace dtsdf {

struct ColourRules {
  /// Distance, in voxels, within which voxels represent their surface: they are painted, and hide
  /// what is behind. Over 0.5, so that each place of a surface has such a voxel.
  float surface_distance = 0.6f;
  /// Least difference in depth between a point's surface and another one, in voxels; below it is
  /// the roughness of the surface itself.
  float hidden_depth = 2.0f;

  /// Side of the squares that pixels are averaged over, in voxels. Finer detail is lost in the map
  /// anyway, and would appear as noise.
  float sample_width = 0.5f;
  /// Largest weight of a colour, in views as good as the newest, so that later views go on
  /// counting.
  int32_t most_views = 8;

  /// Least number of painted voxels from which an image's exposure is estimated; a small part of an
  /// image, chosen by judgement.
  int32_t least_overlap = 256;
};

/// The settings that the rules of painting need.
struct PaintSettings {
  int32_t directional;
  int32_t fixed_exposure;     ///< Use the image's values unchanged.
  float max_depth_m;          ///< Farthest depth of surfaces that are painted and hide others.
  float full_weight_depth_m;  ///< FusionRules::full_weight_depth_m; weights fall as z^-2 beyond it.
  ColourRules rules;
};

}  // namespace dtsdf
