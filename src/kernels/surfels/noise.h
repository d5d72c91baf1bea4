/// The noise of a depth image, estimated from the image itself.
///
/// Fusion has to know it: where noise exceeds the reach of a measurement, outliers no longer
/// average with the surface but form shells of their own, and normals from few pixels scatter.
/// Surfaces are smoother than noise: over seven samples in a line, a polynomial of fourth degree
/// describes the surface, and the rest is noise. Noise that neighbours share shifts the whole of a
/// short line, so longer lines are used as well. These also see the surface's detail, but that
/// varies over the image, while noise is taken to be the same everywhere.
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

/// Kinds of lines: two with three pixels between samples, along the row and down the column; two
/// with seven, the width of a stereo camera's matching windows; and short ones. Rows and columns
/// may differ in noise.
constexpr int kNoiseKinds = 5, kShortLines = kNoiseKinds - 1;
constexpr int kNoiseSteps = 3;  ///< Lines at each point, with different steps.

/// Location of a line's samples.
struct NoiseLinePlace {
  Pixel middle;
  int step_px;  ///< Between samples.
  bool is_column;
  int kind;
};

/// Location of a grid point in the image. In images smaller than the grid, pixels occur, and count,
/// more than once.
DTSDF_HD Pixel noisePoint(int column, int row, int width, int height) {
  return {(2 * column + 1) * width / (2 * kNoiseColumns),
          (2 * row + 1) * height / (2 * kNoiseRows)};
}

/// The line with this step at a grid point; lines alternate between rows and columns.
DTSDF_HD NoiseLinePlace noiseLinePlace(int column, int row, const Pixel& middle, int step) {
  const int step_px = step == 0 ? 3 : (step == 1 ? 7 : 1), odd = (column + row) % 2;
  return {middle, step_px, odd == 1, step < 2 ? 2 * step + odd : kShortLines};
}

/// The same by the point's index, from 0 to kNoisePoints - 1.
DTSDF_HD NoiseLinePlace noiseLinePlace(int index, int step, int width, int height) {
  const int column = index % kNoiseColumns, row = index / kNoiseColumns;
  return noiseLinePlace(column, row, noisePoint(column, row, width, height), step);
}

/// Value of a gap between two pixels of a line: their mean if both are measured, else 0.
DTSDF_HD float meanOfBoth(float a, float b) { return a > 0.0f && b > 0.0f ? 0.5f * (a + b) : 0.0f; }

/// Reads the inverse depths of a line. @return false if the line leaves the image, its middle is
/// not measured, or another of its pixels is neither measured nor between two measured ones along
/// the line. `measured(u, v)` is inverseDepth() of a pixel.
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
  for (int i = 0; i < kNoiseLength; ++i) {  // read all before any is tested: most are measured
    inverse_depth[i] = sampleAt((i - kNoiseRadius) * step_px);
  }
  for (int i = 0; i < kNoiseLength; ++i) {
    float& value = inverse_depth[i];
    const int offset_px = (i - kNoiseRadius) * step_px;
    if (value == 0.0f && at + offset_px > 0 && at + offset_px + 1 < count) {
      value = meanOfBoth(sampleAt(offset_px - 1), sampleAt(offset_px + 1));
    }
    if (!(value > 0.0f)) return false;
  }
  return true;
}

/// Variance at 1 m (DepthNoise) of what no polynomial of fourth degree explains in a line's
/// samples; negative unless all are measured on one surface. It is what the orthogonal polynomials
/// of fifth and sixth degree take up; the sums of their squares are 84 and 924.
DTSDF_HD float noiseVariance(const float (&inverse_depth)[kNoiseLength],
                             const SurfelSettings& surfels) {
  for (int i = 0; i < kNoiseLength; ++i) {
    if (!(inverse_depth[i] > 0.0f)) return -1.0f;
    const float before = inverse_depth[i > 0 ? i - 1 : 0];
    if (isEdgeBetween(before, inverse_depth[i], surfels.depth_jump)) return -1.0f;  // not noise
  }
  const float origin = inverse_depth[kNoiseRadius];
  float odd[kNoiseRadius + 1], even[kNoiseRadius + 1];  // from pairs of samples k to both sides
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

/// Bins an eighth of an octave wide: a float's exponent and three bits of its fraction.
DTSDF_HD int noiseBin(float variance) {
  uint32_t bits;
  memcpy(&bits, &variance, sizeof(bits));
  return static_cast<int>(bits >> 20);
}

constexpr int kNoiseQuartiles = 3;

/// Rank of the lower quartile, median or upper quartile (0, 1, 2) in the order of the lines'
/// variances.
DTSDF_HD uint32_t quartileRank(uint32_t lines, int quartile) { return lines * (quartile + 1) / 4; }

/// Variance of the noise if the lines' quartile is at the lower end of this bin. With two degrees
/// of freedom, the lines' variances are distributed exponentially around it.
DTSDF_HD float noiseOfBin(int bin, int quartile) {
  constexpr float kShares[kNoiseQuartiles] = {0.28768207f, 0.69314718f, 1.38629436f};
  const uint32_t bits = static_cast<uint32_t>(bin) << 20;
  float variance;
  memcpy(&variance, &bits, sizeof(variance));
  return variance / kShares[quartile];
}

/// Variances of noise from each quartile of one kind of line, equal if all is noise; 0 without
/// lines.
struct NoiseOfLines {
  float quartiles[kNoiseQuartiles];
  uint32_t lines;
};

/// The variance common to the whole image: the lower quartile less its difference from the upper,
/// which is due to the detail of surfaces. 0 for few lines, whose quartiles scatter too much.
DTSDF_HD float commonVariance(const NoiseOfLines& of) {
  constexpr uint32_t kMinLines = 16;
  if (of.lines < kMinLines) return 0.0f;
  const float common = 2.0f * of.quartiles[0] - of.quartiles[2];
  return maximum(0.0f, minimum(common, of.quartiles[1]));
}

/// Standard deviation of an image's noise. Short lines see hardly any detail, so their median is
/// all noise; the longest lines may raise the estimate only up to a limit.
DTSDF_HD float combinedNoise(const NoiseOfLines (&kinds)[kNoiseKinds], const SurfelRules& rules) {
  const float three = maximum(commonVariance(kinds[0]), commonVariance(kinds[1]));
  const float seven = maximum(commonVariance(kinds[2]), commonVariance(kinds[3]));
  const float near_variance = maximum(kinds[kShortLines].quartiles[1], three);
  const float most = rules.largest_shared_noise * rules.largest_shared_noise * near_variance;
  return sqrtf(maximum(near_variance, minimum(seven, most)));
}

}  // namespace dtsdf
