/// From raw depths to inverse depths, and which of them may lie on one surface.
#pragma once

#include "kernels/surfels/sensing.h"

namespace dtsdf {

/// A sensor's values: the length of their unit, and the depths that count as measured.
struct DepthRange {
  float unit_m, min_m, max_m;
};

/// Inverse depth of a raw value in 1/m, or 0 where it is no measurement in range.
DTSDF_HD float inverseDepth(float raw, const DepthRange& range) {
  const float depth_m = raw * range.unit_m;
  const bool usable = depth_m >= range.min_m && depth_m <= range.max_m;  // false for NaN
  return usable ? 1.0f / depth_m : 0.0f;
}

/// Whether two neighbouring inverse depths may lie on one surface.
DTSDF_HD bool depthsConnected(float a, float b, const SurfelSettings& surfels) {
  return fabsf(b - a) <= maximum(surfels.depth_jump * maximum(a, b), surfels.rules.connected_noise);
}

}  // namespace dtsdf
