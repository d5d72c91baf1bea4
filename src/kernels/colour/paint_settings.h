/// What the rules that paint need to know of the settings, and of fusion.
#pragma once

#include "kernels/colour/colour_rules.h"

namespace dtsdf {

struct PaintSettings {
  int32_t directional;
  int32_t fixed_exposure;     ///< Images are taken as they are.
  float max_depth_m;          ///< Up to which surfaces are painted, and hide others.
  float full_weight_depth_m;  ///< That of fusion: a view from farther away counts less, by z^-2.
  ColourRules rules;
};

}  // namespace dtsdf
