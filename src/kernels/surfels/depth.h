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

/// Whether a depth edge lies between two inverse depths, by the share that neighbours may differ.
DTSDF_HD bool isEdgeBetween(float a, float b, float depth_jump) {
  return fabsf(b - a) > depth_jump * maximum(fabsf(a), fabsf(b));
}

/// The inverse depth of a pixel that is not measured, between two on one surface: the mean of the
/// pair across it that differs least; 0 where there is no such pair. Registered and rectified
/// images have lines of such pixels all over. `beside(du, dv)` is inverseDepth() of the eight
/// pixels around.
template <class Beside>
DTSDF_HD float inverseDepthInGap(const Beside& beside, float depth_jump) {
  constexpr int kPairs = 4;
  constexpr int kRight[kPairs] = {1, 0, 1, 1}, kDown[kPairs] = {0, 1, 1, -1};
  float least = 1e30f, mean = 0.0f;
  for (int i = 0; i < kPairs; ++i) {
    const float a = beside(-kRight[i], -kDown[i]), b = beside(kRight[i], kDown[i]);
    const float step = fabsf(b - a);
    const bool is_better = static_cast<bool>(static_cast<int>(a != 0.0f) &
                                             static_cast<int>(!isEdgeBetween(a, b, depth_jump)) &
                                             static_cast<int>(step < least));
    mean = is_better ? 0.5f * (a + b) : mean;
    least = is_better ? step : least;
  }
  return mean;
}

DTSDF_HD bool isAtImageBorder(int width, int height, const Pixel& pixel) {
  return pixel.u == 0 || pixel.v == 0 || pixel.u + 1 == width || pixel.v + 1 == height;
}

/// Inverse depth of a pixel with its gap filled. `at(u, v)` is inverseDepth() of a pixel.
template <class At>
DTSDF_HD float filledInverseDepth(const At& at, int width, int height, const Pixel& pixel,
                                  float depth_jump) {
  const float own = at(pixel.u, pixel.v);
  if (own != 0.0f || isAtImageBorder(width, height, pixel)) return own;
  const auto beside = [&](int du, int dv) { return at(pixel.u + du, pixel.v + dv); };
  return inverseDepthInGap(beside, depth_jump);
}

}  // namespace dtsdf
