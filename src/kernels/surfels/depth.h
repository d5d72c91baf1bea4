/// From raw depths to inverse depths, and what lies in gaps between them.
#pragma once

#include "kernels/surfels/sensing.h"

namespace dtsdf {

/// A sensor's values: the length of their unit, the depths that are fused, and the value from which
/// on there is none: the largest of 16 bits, which drivers use for "out of range".
struct DepthRange {
  float unit_m, min_m, max_m, overflow;
  float rounded_to_m;  ///< The unit of whole numbers; 0 for floats.
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

/// How far a plane that goes through a gap may be off, in 1/m: what noise explains of a difference,
/// rounding to whole units, as in predictsGap(), and that of floats.
DTSDF_HD float gapTolerance(const SurfelSettings& surfels, const DepthNoise& noise,
                            float rounded_to_m, float inverse_depth) {
  constexpr float kUnits = 1.5f, kRounding = 2e-6f;
  return noiseOfStep(noise, inverse_depth, surfels.rules.noise_level) +
         inverse_depth * (kUnits * rounded_to_m * inverse_depth + kRounding);
}

/// Whether the pixels on one side of a gap predict it; one that is not measured does not object.
DTSDF_HD bool predictsGap(float beside, float behind_it, float in_gap, float tolerance) {
  return behind_it == 0.0f || fabsf((beside + beside - fabsf(behind_it)) - in_gap) <= tolerance;
}

/// Whether a line of empty pixels goes on: the next one is empty as well, between two measured
/// ones.
DTSDF_HD bool goesOn(float next, float one_side, float other_side) {
  return next == 0.0f && one_side != 0.0f && other_side != 0.0f;
}

/// Whether an empty pixel is on such a line along a row or a column, by the pixels before and after
/// it in its row, its column, and its diagonals down and up.
DTSDF_HD bool isOnALine(const float* before, const float* after) {
  const float left = before[0], right = after[0], above = before[1], below = after[1];
  const float above_left = before[2], below_right = after[2];
  const float below_left = before[3], above_right = after[3];
  const bool in_row =
      above != 0.0f && below != 0.0f &&
      (goesOn(left, above_left, below_left) || goesOn(right, above_right, below_right));
  const bool in_column =
      left != 0.0f && right != 0.0f &&
      (goesOn(above, above_left, above_right) || goesOn(below, below_left, below_right));
  return in_row || in_column;
}

/// Inverse depth of a pixel, that of a gap if it is not measured between two that are, on a plane
/// that these and those behind them predict: the mean of the two, of the pair across it that
/// differs least. Else 0. Registered and rectified images have lines of such pixels all over. Where
/// it is on no line, two pairs have to fit: one alone may be the sides of a notch in an outline,
/// which lies outside of the surface. `measured(u, v)` is inverseDepth() of a pixel; depths were
/// rounded to so many metres.
template <class Measured>
DTSDF_HD float filledInverseDepth(const Measured& measured, int width, int height,
                                  const Pixel& pixel, const SurfelSettings& surfels,
                                  const DepthNoise& noise, float rounded_to_m) {
  const float own = measured(pixel.u, pixel.v);
  if (own != 0.0f) return own;
  constexpr int kPairs = 4;
  constexpr int kRight[kPairs] = {1, 0, 1, 1}, kDown[kPairs] = {0, 1, 1, -1};
  const auto at = [&](int pair, int steps) {
    const int u = pixel.u + steps * kRight[pair], v = pixel.v + steps * kDown[pair];
    return u >= 0 && v >= 0 && u < width && v < height ? measured(u, v) : 0.0f;
  };
  float before[kPairs], after[kPairs];
  for (int i = 0; i < kPairs; ++i) {  // all at once, before any is asked
    before[i] = at(i, -1);
    after[i] = at(i, 1);
  }
  float least_step = 1e30f, mean = 0.0f, nearest = 0.0f;
  int32_t fitting = 0;
  for (int i = 0; i < kPairs; ++i) {
    const float a = before[i], b = after[i], step = fabsf(b - a), in_gap = 0.5f * (a + b);
    if (a == 0.0f || b == 0.0f) continue;
    nearest = maximum(nearest, maximum(fabsf(a), fabsf(b)));
    if (isEdgeBetween(a, b, surfels.depth_jump)) continue;
    const float tolerance = gapTolerance(surfels, noise, rounded_to_m, fabsf(in_gap));
    // Measurements beyond the range are negative, on both sides of it or on none.
    if (!predictsGap(fabsf(a), at(i, -2), fabsf(in_gap), tolerance) ||
        !predictsGap(fabsf(b), at(i, 2), fabsf(in_gap), tolerance)) {
      continue;
    }
    ++fitting;
    if (step >= least_step) continue;
    least_step = step;
    mean = in_gap;
  }
  return fitting > 1 || (fitting == 1 && isOnALine(before, after)) ? mean : 0.0f - nearest;
}

}  // namespace dtsdf
