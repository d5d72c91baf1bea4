/// Settings of painting: how colour images go into the map.
#pragma once

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// How colour images are painted.
struct PaintParams {
  /// Match each to the brightness of the same surface in the map; false: exposure and white balance
  /// of the camera are locked.
  bool adapt_exposure = true;
  float max_depth_m = 0.0f;  ///< Surfaces farther from an image are not painted by it; 0: all are.
};

/// Visits each member with its key and its rule.
/// @relates PaintParams
template <class Visitor>
void visitParams(PaintParams& p, Visitor& visit) {
  visit("colour/exposure", p.adapt_exposure, EnumNames<bool>{{"adaptive", true}, {"fixed", false}});
  visit("colour/max_depth_m", p.max_depth_m, Range{0.0, 1000.0});
}

}  // namespace dtsdf
