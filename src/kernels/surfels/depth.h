/// From raw depths to inverse depths.
#pragma once

#include "kernels/surfels/sensing.h"

namespace dtsdf {

/// A sensor's values: the length of their unit, the depths that are fused, and the value from which
/// on there is none: the largest of 16 bits, which drivers use for "out of range".
struct DepthRange {
  float unit_m, min_m, max_m, overflow;
};

/// Inverse depth of a raw value in 1/m; 0 where nothing is measured, or too near. Negative where it
/// is measured beyond the range that is fused: no surface is made of it, but what lies before it is
/// free. So are all tests for "above 0" tests for a measurement to fuse.
DTSDF_HD float inverseDepth(float raw, const DepthRange& range) {
  const float depth_m = raw * range.unit_m;
  // Without branches, for vector instructions. No comparison holds for NaN.
  const auto measured = static_cast<float>(static_cast<int32_t>(depth_m >= range.min_m) &
                                           static_cast<int32_t>(raw < range.overflow));
  const auto fused = static_cast<float>(depth_m <= range.max_m);
  const float sign = measured * (fused + fused) - measured;  // 1, -1 or 0
  return sign / maximum(depth_m, range.min_m);
}

}  // namespace dtsdf
