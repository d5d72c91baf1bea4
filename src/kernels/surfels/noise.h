/// Estimates the noise of a depth image from the image itself.
///
/// Over seven samples in a line, a polynomial of fourth degree describes the surface, and the rest
/// is noise. Short lines do not reveal noise that is correlated between neighbouring pixels, so
/// longer lines are used as well. These also contain surface detail, but detail varies over the
/// image, while noise is assumed to be the same everywhere.
#pragma once

#include <cstring>

#include "kernels/surfels/depth.h"

namespace dtsdf {

/// Lines are centred on the points of a grid of this size over the image.
constexpr int kNoiseColumns = 96, kNoiseRows = 64;
constexpr int kNoisePoints = kNoiseColumns * kNoiseRows;
constexpr int kNoiseRadius = 3;  ///< Half length of a line, in samples.
constexpr int kNoiseLength = 2 * kNoiseRadius + 1;
constexpr int kNoiseBins = 1 << 11;

/// Kinds of lines: 0 and 1 with steps of three pixels, along rows and columns; 2 and 3 with steps
/// of seven, about the width of a stereo camera's matching window; 4 with steps of one, along
/// either. Rows and columns are separate because their noise may differ.
constexpr int kNoiseKinds = 5, kShortLines = kNoiseKinds - 1;
constexpr int kNoiseSteps = 3;  ///< Lines at each grid point, one per step.

struct NoiseLinePlace {
  Pixel middle;
  int step_px;  ///< Between samples.
  bool is_column;
  int kind;
};

/// The pixel at a grid point. In images smaller than the grid, several points may fall on the same
/// pixel, which then counts several times.
DTSDF_HD Pixel noisePoint(int column, int row, int width, int height) {
  return {(2 * column + 1) * width / (2 * kNoiseColumns),
          (2 * row + 1) * height / (2 * kNoiseRows)};
}

/// The line at a grid point with step index `step` (0: three pixels, 1: seven, 2: one). Lines
/// alternate between rows and columns.
DTSDF_HD NoiseLinePlace noiseLinePlace(int column, int row, const Pixel& middle, int step) {
  const int step_px = step == 0 ? 3 : (step == 1 ? 7 : 1), odd = (column + row) % 2;
  return {middle, step_px, odd == 1, step < 2 ? 2 * step + odd : kShortLines};
}

/// Takes the index of the grid point, from 0 to kNoisePoints - 1.
DTSDF_HD NoiseLinePlace noiseLinePlace(int index, int step, int width, int height) {
  const int column = index % kNoiseColumns, row = index / kNoiseColumns;
  return noiseLinePlace(column, row, noisePoint(column, row, width, height), step);
}

/// Value of a gap between two pixels of a line: their mean if both are measured, otherwise 0.
DTSDF_HD float gapValue(float a, float b) { return a > 0.0f && b > 0.0f ? 0.5f * (a + b) : 0.0f; }

/// Reads the inverse depths of a line. `measured(u, v)` returns inverseDepth() of a pixel. @return
/// false if the line leaves the image, its middle is not measured within the fused range, or
/// another sample is neither measured nor between two measured pixels along the line.
template <class Measured>
DTSDF_HD bool readNoiseLine(const Measured& measured, int width, int height,
                            const NoiseLinePlace& place, float (&inverse_depth)[kNoiseLength]) {
  const Pixel& middle = place.middle;
  const int step_px = place.step_px;
  const bool is_column = place.is_column;
  const int reach_px = step_px * kNoiseRadius;
  const int at = is_column ? middle.v : middle.u, count = is_column ? height : width;
  if (at < reach_px || at + reach_px >= count || !(measured(middle.u, middle.v) > 0.0f)) {
    return false;
  }
  const int along_u = is_column ? 0 : 1, along_v = is_column ? 1 : 0;
  const auto sampleAt = [&](int offset_px) {
    return measured(middle.u + along_u * offset_px, middle.v + along_v * offset_px);
  };
  for (int i = 0; i < kNoiseLength; ++i) {
    inverse_depth[i] = sampleAt((i - kNoiseRadius) * step_px);
  }
  for (int i = 0; i < kNoiseLength; ++i) {
    float& value = inverse_depth[i];
    const int offset_px = (i - kNoiseRadius) * step_px;
    if (value == 0.0f && at + offset_px > 0 && at + offset_px + 1 < count) {
      value = gapValue(sampleAt(offset_px - 1), sampleAt(offset_px + 1));
    }
    if (!(value > 0.0f)) return false;
  }
  return true;
}

/// Variance of the noise in a line's samples, at 1 m (see DepthNoise): half the sum of their
/// squared components along the orthogonal polynomials of fifth and sixth degree, whose squared
/// norms are 84 and 924. Negative if a sample is not measured, or a depth edge lies between two.
DTSDF_HD float noiseVariance(const float (&inverse_depth)[kNoiseLength],
                             const SurfelSettings& surfels) {
  for (int i = 0; i < kNoiseLength; ++i) {
    if (!(inverse_depth[i] > 0.0f)) return -1.0f;
    const float before = inverse_depth[i > 0 ? i - 1 : 0];
    if (isEdgeBetween(before, inverse_depth[i], surfels.depth_jump)) return -1.0f;
  }
  const float origin = inverse_depth[kNoiseRadius];
  float odd[kNoiseRadius + 1], even[kNoiseRadius + 1];  // for samples k steps to either side
  for (int k = 1; k <= kNoiseRadius; ++k) {
    const float after = inverse_depth[kNoiseRadius + k] - origin;
    const float before = inverse_depth[kNoiseRadius - k] - origin;
    odd[k] = after - before;
    even[k] = after + before;
  }
  const float fifth = 5.0f * odd[1] - 4.0f * odd[2] + odd[3];
  const float sixth = 15.0f * even[1] - 6.0f * even[2] + even[3];
  const float variance = 0.5f * (fifth * fifth / 84.0f + sixth * sixth / 924.0f);
  const float square = origin * origin;
  return surfels.noise_in_depth != 0 ? variance / (square * square) : variance;
}

/// Bin of a variance, eight per octave: a float's exponent and three bits of its fraction.
DTSDF_HD int noiseBin(float variance) {
  uint32_t bits;
  memcpy(&bits, &variance, sizeof(bits));
  return static_cast<int>(bits >> 20);
}

constexpr int kNoiseQuartiles = 3;

/// Rank of a quartile (0: lower, 1: median, 2: upper) among the variances of `lines` lines.
DTSDF_HD uint32_t quartileRank(uint32_t lines, int quartile) { return lines * (quartile + 1) / 4; }

/// Variance of the noise if this quartile of the lines' variances lies at the lower end of `bin`.
/// With two degrees of freedom, the lines' variances are distributed exponentially.
DTSDF_HD float noiseOfBin(int bin, int quartile) {
  constexpr float kShares[kNoiseQuartiles] = {0.28768207f, 0.69314718f, 1.38629436f};
  const uint32_t bits = static_cast<uint32_t>(bin) << 20;
  float variance;
  memcpy(&variance, &bits, sizeof(variance));
  return variance / kShares[quartile];
}

/// The noise's variance as estimated from each quartile of one kind of line; 0 if there are no
/// lines. The estimates should be equal if the lines contain only noise.
struct NoiseOfLines {
  float quartiles[kNoiseQuartiles];
  uint32_t lines;
};

/// The variance common to the whole image: the estimate from the lower quartile, minus the
/// difference between the estimates from the upper and the lower quartile, which is due to surface
/// detail; at most the estimate from the median. 0 if there are too few lines, as their quartiles
/// are unreliable.
DTSDF_HD float commonVariance(const NoiseOfLines& of) {
  constexpr uint32_t kMinLines = 16;
  if (of.lines < kMinLines) return 0.0f;
  const float common = 2.0f * of.quartiles[0] - of.quartiles[2];
  return maximum(0.0f, minimum(common, of.quartiles[1]));
}

/// Standard deviation of an image's noise. Short lines contain hardly any detail, so their median
/// is used directly. The longest lines may raise the estimate only up to a limit.
DTSDF_HD float combinedNoise(const NoiseOfLines (&kinds)[kNoiseKinds], const SurfelRules& rules) {
  const float three = maximum(commonVariance(kinds[0]), commonVariance(kinds[1]));
  const float seven = maximum(commonVariance(kinds[2]), commonVariance(kinds[3]));
  const float near_variance = maximum(kinds[kShortLines].quartiles[1], three);
  const float most = rules.largest_shared_noise * rules.largest_shared_noise * near_variance;
  return sqrtf(maximum(near_variance, minimum(seven, most)));
}

}  // namespace dtsdf
