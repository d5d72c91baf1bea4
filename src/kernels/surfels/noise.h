/// The noise of a depth image, estimated from the image itself.
///
/// Fusion has to know it: where noise exceeds the reach of a measurement, outliers no longer
/// average with the surface but form shells of their own, and normals from few pixels scatter.
/// Surfaces are smoother than noise: over seven samples in line a polynomial of fourth degree
/// explains what they do, and what it leaves is noise. Noise that neighbours share moves all of a
/// short line, so longer ones are looked at, too. These see a surface's detail as well, which
/// differs from place to place, where noise is taken to be the same all over the image.
#pragma once

#include <cstring>

#include "kernels/surfels/depth.h"

namespace dtsdf {

/// Lines are laid at the points of a grid of this size over the image.
constexpr int kNoiseColumns = 96, kNoiseRows = 64;
constexpr int kNoisePoints = kNoiseColumns * kNoiseRows;
constexpr int kNoiseRadius = 3;  ///< Half length of a line, in samples.
constexpr int kNoiseLength = 2 * kNoiseRadius + 1;
constexpr int kNoiseBins = 1 << 11;

/// Kinds of lines: with three pixels from sample to sample, along the row and down the column; with
/// seven, as wide as the windows are that stereo cameras match, along the row and down the column;
/// and short ones. Rows and columns may have noise of their own.
constexpr int kNoiseKinds = 5, kShortLines = kNoiseKinds - 1;
constexpr int kNoiseSteps = 3;  ///< Lines at each point, of other steps.

/// Where the samples of a line lie.
struct NoiseLinePlace {
  Pixel middle;
  int step_px;  ///< From sample to sample.
  bool is_column;
  int kind;
};

/// Where a point of the grid lies in the image. In images smaller than the grid pixels come up, and
/// count, more than once.
DTSDF_HD Pixel noisePoint(int column, int row, int width, int height) {
  return {(2 * column + 1) * width / (2 * kNoiseColumns),
          (2 * row + 1) * height / (2 * kNoiseRows)};
}

/// The line of a step at a point of the grid; along the row and down the column by turns.
DTSDF_HD NoiseLinePlace noiseLinePlace(int column, int row, const Pixel& middle, int step) {
  const int step_px = step == 0 ? 3 : (step == 1 ? 7 : 1), odd = (column + row) % 2;
  return {middle, step_px, odd == 1, step < 2 ? 2 * step + odd : kShortLines};
}

/// The line of a step at a point by its index, from 0 to kNoisePoints - 1.
DTSDF_HD NoiseLinePlace noiseLinePlace(int index, int step, int width, int height) {
  const int column = index % kNoiseColumns, row = index / kNoiseColumns;
  return noiseLinePlace(column, row, noisePoint(column, row, width, height), step);
}

/// What lies in a gap between two pixels on one line, if both are measured; else 0.
DTSDF_HD float meanOfBoth(float a, float b) { return a > 0.0f && b > 0.0f ? 0.5f * (a + b) : 0.0f; }

/// Takes the inverse depths of the line at a place. @return false where it does not lie in the
/// image, its middle is not measured, or another pixel of it is neither measured nor between two
/// along it. `measured(u, v)` is inverseDepth() of a pixel.
template <class Measured>
DTSDF_HD bool takeNoiseLine(const Measured& measured, int width, int height,
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
  for (int i = 0; i < kNoiseLength; ++i) {  // all at once: most are measured
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

/// Variance of a line's samples at 1 m (DepthNoise), of what no polynomial of fourth degree
/// explains; negative where they are not all measured on one surface. That is what the orthogonal
/// polynomials of fifth and sixth degree take up; their squares add up to 84 and 924.
DTSDF_HD float noiseVariance(const float (&inverse_depth)[kNoiseLength],
                             const SurfelSettings& surfels) {
  for (int i = 0; i < kNoiseLength; ++i) {
    if (!(inverse_depth[i] > 0.0f)) return -1.0f;
    const float before = inverse_depth[i > 0 ? i - 1 : 0];
    if (isEdgeBetween(before, inverse_depth[i], surfels.depth_jump)) return -1.0f;  // no noise
  }
  const float origin = inverse_depth[kNoiseRadius];
  float odd[kNoiseRadius + 1], even[kNoiseRadius + 1];  // of samples k to both sides
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

/// Bins of an eighth of an octave: the exponent of a float and three bits of its fraction.
DTSDF_HD int noiseBin(float variance) {
  uint32_t bits;
  memcpy(&bits, &variance, sizeof(bits));
  return static_cast<int>(bits >> 20);
}

constexpr int kNoiseQuartiles = 3;

/// Rank of the lower quartile, the median or the upper quartile (0, 1, 2) among so many lines in
/// the order of their variances.
DTSDF_HD uint32_t quartileRank(uint32_t lines, int quartile) { return lines * (quartile + 1) / 4; }

/// Variance of the noise of which lines at a quartile have the lower end of a bin. With two degrees
/// of freedom the variances of lines are distributed exponentially around it.
DTSDF_HD float noiseOfBin(int bin, int quartile) {
  constexpr float kShares[kNoiseQuartiles] = {0.28768207f, 0.69314718f, 1.38629436f};
  const uint32_t bits = static_cast<uint32_t>(bin) << 20;
  float variance;
  memcpy(&variance, &bits, sizeof(variance));
  return variance / kShares[quartile];
}

/// Variances of noise from the quartiles of one kind of line: equal where all is noise. 0 where
/// there are no lines.
struct NoiseOfLines {
  float quartiles[kNoiseQuartiles];
  uint32_t lines;
};

/// The variance that all of an image has: less than the lower quartile by as much as the upper one
/// is more, which the detail of surfaces accounts for. Of few lines quartiles scatter too much.
DTSDF_HD float commonVariance(const NoiseOfLines& of) {
  constexpr uint32_t kLeastLines = 16;
  if (of.lines < kLeastLines) return 0.0f;
  const float common = 2.0f * of.quartiles[0] - of.quartiles[2];
  return maximum(0.0f, minimum(common, of.quartiles[1]));
}

/// The deviation of an image's noise. Short lines see hardly any detail, so that all that most of
/// them show is noise; the longest may raise the estimate only so far.
DTSDF_HD float combinedNoise(const NoiseOfLines (&kinds)[kNoiseKinds], const SurfelRules& rules) {
  const float three = maximum(commonVariance(kinds[0]), commonVariance(kinds[1]));
  const float seven = maximum(commonVariance(kinds[2]), commonVariance(kinds[3]));
  const float near_variance = maximum(kinds[kShortLines].quartiles[1], three);
  const float most = rules.largest_shared_noise * rules.largest_shared_noise * near_variance;
  return sqrtf(maximum(near_variance, minimum(seven, most)));
}

}  // namespace dtsdf
