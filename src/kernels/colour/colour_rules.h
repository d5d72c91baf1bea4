/// Parameters of the rules that paint surfaces, with their default values and the reasons for them.
#pragma once

#include <cstdint>

namespace dtsdf {

struct ColourRules {
  /// Voxels within this distance of a surface, in voxels, are painted and hide what is behind them.
  /// Above 0.5, so that there are such voxels everywhere along a surface.
  float surface_distance = 0.6f;
  /// A surface hides points that are farther from the camera by more than this, in voxels. Smaller
  /// differences are due to the roughness of the surface.
  float hidden_depth = 2.0f;

  /// Side in voxels of the squares over which pixels are averaged. Finer detail is lost in the map
  /// anyway, and would appear as noise.
  float sample_width = 0.5f;
  /// A view increases a colour's weight to at most this multiple of the view's own weight, so that
  /// new views still have an effect. A weight that is already larger is kept.
  int32_t max_views = 8;

  /// Minimum number of painted voxels for estimating an image's exposure; chosen by judgement.
  int32_t min_overlap = 256;
};

/// Settings for painting.
struct PaintSettings {
  int32_t directional;
  int32_t fixed_exposure;     ///< 1 if the image's values are used unchanged.
  float max_depth_m;          ///< Maximum depth of surfaces that are painted or hide others.
  float full_weight_depth_m;  ///< FusionRules::full_weight_depth_m; weights fall as z^-2 beyond it.
  ColourRules rules;
};

}  // namespace dtsdf
