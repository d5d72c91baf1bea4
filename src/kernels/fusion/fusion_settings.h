/// What the rules of fusion need to know of the settings.
#pragma once

#include <cstdint>

#include "kernels/fusion/fusion_rules.h"
#include "kernels/surfels/surfel_rules.h"

namespace dtsdf {

struct FusionSettings {
  int32_t cast_along_normal;  ///< Else along the view ray.
  int32_t directional;
  float truncation_voxels;
  float max_weight;
  FusionRules rules;
  /// So many standard deviations are noise, here as where surfels are made.
  float noise_level = SurfelRules().noise_level;
};

}  // namespace dtsdf
