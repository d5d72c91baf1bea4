/// Settings of painting: how colour images go into the map.
#pragma once

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// How to treat images that differ in brightness.
enum class ImageExposure {
  kAdaptive,  ///< Match each to the brightness of the same surface in the map.
  kFixed,     ///< Use them as they are: the camera's exposure and white balance are locked.
};

/// How colour images are painted.
struct PaintParams {
  ImageExposure exposure = ImageExposure::kAdaptive;  ///< What is done about their brightness.
  float max_depth_m = 0.0f;  ///< Surfaces farther from an image are not painted by it; 0: all are.
};

/// Visits each member with its key and its rule.
/// @relates PaintParams
template <class Visitor>
void visitParams(PaintParams& p, Visitor& visit) {
  visit("colour/exposure", p.exposure,
        EnumNames<ImageExposure>{{"adaptive", ImageExposure::kAdaptive},
                                 {"fixed", ImageExposure::kFixed}});
  visit("colour/max_depth_m", p.max_depth_m, Range{0.0, 1000.0});
}

}  // namespace dtsdf
