/// Converts raw depths to inverse depths, and fills small gaps.
#pragma once

#include "kernels/surfels/sensing.h"

namespace dtsdf {

/// The unit of raw depths, and the range of depths that are fused. Raw values of `overflow` or more
/// are not measurements.
struct DepthRange {
  float unit_m, min_m, max_m, overflow;
  float rounded_to_m;  ///< Unit of integer depths; 0 for floats.
};

/// Inverse depth of a raw value, in 1/m. Positive values are fused. Negative values lie beyond the
/// fused range: they create no surface, but the space in front of them is free. 0 means that
/// nothing was measured, or that the depth is too small.
DTSDF_HD float inverseDepth(float raw, const DepthRange& range) {
  const float depth_m = raw * range.unit_m;
  // Branch-free, for vectorisation. Comparisons with NaN are false.
  const auto measured = static_cast<float>(static_cast<int32_t>(depth_m >= range.min_m) &
                                           static_cast<int32_t>(raw < range.overflow));
  const auto fused = static_cast<float>(depth_m <= range.max_m);
  const float sign = measured * (fused + fused) - measured;  // 1, -1 or 0
  return sign / maximum(depth_m, range.min_m);
}

/// Whether there is a depth edge between two inverse depths, that is, whether they differ by more
/// than `depth_jump` times the larger of them.
DTSDF_HD bool isEdgeBetween(float a, float b, float depth_jump) {
  return fabsf(b - a) > depth_jump * maximum(fabsf(a), fabsf(b));
}

/// Largest difference, in 1/m, between the value of a gap and the plane beside it: the noise of a
/// difference, plus the errors that rounding to integer depths and to floats causes in
/// predictsGap().
DTSDF_HD float gapTolerance(const SurfelSettings& surfels, const DepthNoise& noise,
                            float rounded_to_m, float inverse_depth) {
  constexpr float kUnits = 1.5f, kRounding = 2e-6f;
  return noiseOfStep(noise, inverse_depth, surfels.rules.noise_level) +
         inverse_depth * (kUnits * rounded_to_m * inverse_depth + kRounding);
}

/// Whether the two pixels on one side of a gap predict its value; true if the second, `behind_it`,
/// is not measured.
DTSDF_HD bool predictsGap(float beside, float behind_it, float in_gap, float tolerance) {
  return behind_it == 0.0f || fabsf((beside + beside - fabsf(behind_it)) - in_gap) <= tolerance;
}

/// Whether a line of empty pixels continues: the next pixel must be empty as well, and lie between
/// two measured pixels.
DTSDF_HD bool emptyLineContinues(float next, float one_side, float other_side) {
  return next == 0.0f && one_side != 0.0f && other_side != 0.0f;
}

/// Whether an empty pixel is part of a line of empty pixels along its row or column. `before` and
/// `after` hold its opposite neighbours along the row, the column, the falling and the rising
/// diagonal.
DTSDF_HD bool isOnEmptyLine(const float* before, const float* after) {
  const float left = before[0], right = after[0], above = before[1], below = after[1];
  const float above_left = before[2], below_right = after[2];
  const float below_left = before[3], above_right = after[3];
  const bool in_row = above != 0.0f && below != 0.0f &&
                      (emptyLineContinues(left, above_left, below_left) ||
                       emptyLineContinues(right, above_right, below_right));
  const bool in_column = left != 0.0f && right != 0.0f &&
                         (emptyLineContinues(above, above_left, above_right) ||
                          emptyLineContinues(below, below_left, below_right));
  return in_row || in_column;
}

/// Inverse depth of a pixel, with gaps filled. `measured(u, v)` returns inverseDepth() of a pixel;
/// depths were rounded to multiples of `rounded_to_m`.
///
/// An empty pixel takes the mean of two opposite neighbours if these and the pixels behind them lie
/// on a plane without a depth edge. If several pairs qualify, the pair with the smallest difference
/// is used. Away from lines of empty pixels, two pairs must qualify, as a single pair may be the
/// sides of a notch in an outline. An empty pixel that is not filled is free up to the nearest
/// neighbour whose opposite is measured too: its value is the negative of that neighbour's inverse
/// depth, or 0 if there is none.
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
  for (int i = 0; i < kPairs; ++i) {  // first read all, then test them
    before[i] = at(i, -1);
    after[i] = at(i, 1);
  }
  float min_step = 1e30f, mean = 0.0f, nearest = 0.0f;
  int32_t fitting = 0;
  for (int i = 0; i < kPairs; ++i) {
    const float a = before[i], b = after[i], step = fabsf(b - a), in_gap = 0.5f * (a + b);
    if (a == 0.0f || b == 0.0f) continue;
    nearest = maximum(nearest, maximum(fabsf(a), fabsf(b)));
    if (isEdgeBetween(a, b, surfels.depth_jump)) continue;
    const float tolerance = gapTolerance(surfels, noise, rounded_to_m, fabsf(in_gap));
    // Both have the same sign (negative beyond the fused range), as there is no edge between them.
    if (!predictsGap(fabsf(a), at(i, -2), fabsf(in_gap), tolerance) ||
        !predictsGap(fabsf(b), at(i, 2), fabsf(in_gap), tolerance)) {
      continue;
    }
    ++fitting;
    if (step >= min_step) continue;
    min_step = step;
    mean = in_gap;
  }
  return fitting > 1 || (fitting == 1 && isOnEmptyLine(before, after)) ? mean : 0.0f - nearest;
}

}  // namespace dtsdf
