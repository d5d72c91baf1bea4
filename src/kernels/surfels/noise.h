/// The noise of a depth image, estimated from the image itself.
///
/// Fusion has to know it: where noise exceeds the reach of a measurement, outliers no longer
/// average with the surface but form shells of their own, and normals from few pixels scatter. The
/// estimate is robust because it is a median over the image, as the variance about short straight
/// lines in inverse depth: edges are few, and surfaces hardly bend over a few pixels.
#pragma once

#include <cstring>

#include "kernels/surfels/depth.h"

namespace dtsdf {

/// Lines are laid at the points of a grid of this size over the image.
constexpr int kNoiseColumns = 96, kNoiseRows = 64;
constexpr int kNoisePoints = kNoiseColumns * kNoiseRows;
constexpr int kNoiseRadius = 3;                       ///< Half length of a line, in pixels.
constexpr int kNoiseLength = 2 * kNoiseRadius + 1;
constexpr int kNoiseBins = 1 << 10;

/// The middle of a line, from 0 to kNoisePoints - 1. In images smaller than the grid lines come up,
/// and count, more than once.
DTSDF_HD Pixel noisePoint(int index, int width, int height) {
  const int column = index % kNoiseColumns, row = index / kNoiseColumns;
  return {(2 * column + 1) * width / (2 * kNoiseColumns),
          (2 * row + 1) * height / (2 * kNoiseRows)};
}

/// Whether the line around a point lies in the image.
DTSDF_HD bool hasNoiseLine(const Pixel& middle, int width) {
  return middle.u >= kNoiseRadius && middle.u + kNoiseRadius < width;
}

/// Variance of inverse depths about their line, in 1/m^2; negative where they are not all measured
/// on one surface.
DTSDF_HD float varianceAboutLine(const float (&inverse_depth)[kNoiseLength],
                                 const SurfelSettings& surfels) {
  const float origin = inverse_depth[kNoiseRadius];
  float sum_y = 0.0f, sum_yy = 0.0f, sum_ky = 0.0f, sum_kk = 0.0f;
  for (int i = 0; i < kNoiseLength; ++i) {
    if (!(inverse_depth[i] > 0.0f)) return -1.0f;
    if (i > 0 && !depthsConnected(inverse_depth[i - 1], inverse_depth[i], surfels)) return -1.0f;
    const float k = static_cast<float>(i - kNoiseRadius), y = inverse_depth[i] - origin;
    sum_y += y;
    sum_yy += y * y;
    sum_ky += k * y;
    sum_kk += k * k;
  }
  constexpr float kCount = static_cast<float>(kNoiseLength);
  const float about_line = sum_yy - sum_y * sum_y / kCount - sum_ky * sum_ky / sum_kk;
  return maximum(about_line, 0.0f) / (kCount - 2.0f);
}

/// Bins of a quarter of an octave: the exponent of a float and two bits of its fraction.
DTSDF_HD int noiseBin(float variance) {
  uint32_t bits;
  memcpy(&bits, &variance, sizeof(bits));
  return static_cast<int>(bits >> 21);
}

/// Standard deviation of inverse depth at the lower end of a bin, in 1/m.
DTSDF_HD float noiseOfBin(int bin) {
  const uint32_t bits = static_cast<uint32_t>(bin) << 21;
  float variance;
  memcpy(&variance, &bits, sizeof(variance));
  return sqrtf(variance);
}

/// The median of so many lines is the one of this rank.
DTSDF_HD uint32_t medianRank(uint32_t lines) { return lines / 2; }

}  // namespace dtsdf
