/// From raw depths to inverse depths, and what lies in gaps between them.
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

/// What a gap is filled by.
struct GapLimits {
  float depth_jump;        ///< Largest share by which depths on both sides of it may differ.
  DepthNoise off_a_plane;  ///< How far it may be off a plane.
};

DTSDF_HD GapLimits gapLimits(const SurfelSettings& surfels, const DepthNoise& noise) {
  return {surfels.depth_jump, {surfels.rules.noise_level * noise.sigma, noise.in_depth}};
}

/// Those that hold until noise is known, to estimate it.
DTSDF_HD GapLimits gapLimitsOfAnyNoise(const SurfelSettings& surfels) {
  return {surfels.depth_jump, {1e30f, surfels.noise_in_depth}};
}

/// Whether the pixels on one side of a gap predict it; one that is not measured does not object.
DTSDF_HD bool predictsGap(float beside, float behind_it, float in_gap, float tolerance) {
  return behind_it == 0.0f || fabsf((beside + beside - behind_it) - in_gap) <= tolerance;
}

/// Share of an inverse depth by which rounding moves it off the plane of an image without noise.
constexpr float kDepthRounding = 2e-6f;

/// Inverse depth of a pixel, that of a gap if it is not measured between two that are. On a plane
/// that the two and those behind them predict it is the mean of the two, of the pair that differs
/// least. Else it is that of the nearest, negative: no surface is made of it, but up to there it is
/// free. 0 in a wider gap. Registered and rectified images have lines of such pixels all over.
/// `measured(u, v)` is inverseDepth() of a pixel.
template <class Measured>
DTSDF_HD float filledInverseDepth(const Measured& measured, int width, int height,
                                  const Pixel& pixel, const GapLimits& limits) {
  const float own = measured(pixel.u, pixel.v);
  if (own != 0.0f) return own;
  constexpr int kPairs = 4;
  constexpr int kRight[kPairs] = {1, 0, 1, 1}, kDown[kPairs] = {0, 1, 1, -1};
  constexpr float kNone = 1e30f;
  float least_step = kNone, mean = 0.0f, nearest = 0.0f;
  for (int i = 0; i < kPairs; ++i) {
    const auto at = [&](int steps) {
      const int u = pixel.u + steps * kRight[i], v = pixel.v + steps * kDown[i];
      return u >= 0 && v >= 0 && u < width && v < height ? measured(u, v) : 0.0f;
    };
    const float a = at(-1), b = at(1);
    if (a == 0.0f || b == 0.0f) continue;
    nearest = maximum(nearest, maximum(fabsf(a), fabsf(b)));
    const float step = fabsf(b - a), in_gap = 0.5f * (a + b);
    if (isEdgeBetween(a, b, limits.depth_jump) || step >= least_step) continue;
    const float tolerance = noiseAt(limits.off_a_plane, in_gap) + kDepthRounding * fabsf(in_gap);
    if (!predictsGap(a, at(-2), in_gap, tolerance) || !predictsGap(b, at(2), in_gap, tolerance)) {
      continue;
    }
    least_step = step;
    mean = in_gap;
  }
  return least_step < kNone ? mean : -nearest;
}

}  // namespace dtsdf
