// Tests the noise estimate on images with known noise.
#include "cpu/sense.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace dtsdf {
namespace {

constexpr int kWidth = 320, kHeight = 240;

/// Returns the noise estimated from an image whose inverse depths, in 1/m, are 0.5 plus `offsets`.
float estimatedNoise(const std::vector<float>& offsets) {
  std::vector<float> depth_m;
  for (const float offset : offsets) depth_m.push_back(1.0f / (0.5f + offset));
  DepthFrame frame;
  frame.data = depth_m.data();
  frame.width = kWidth;
  frame.height = kHeight;
  frame.row_bytes = kWidth * sizeof(float);
  frame.encoding = DepthEncoding::kFloat32;
  frame.unit_m = 1.0f;
  frame.intrinsics = {500.0f, 500.0f, 0.5f * kWidth, 0.5f * kHeight};
  FrameSensor sensor(MapperParams(), Rules(), 1);
  return sensor.sense(frame).noise.sigma;
}

std::vector<float> whiteNoise(float deviation) {
  std::mt19937 random(3);
  std::normal_distribution<float> error(0.0f, deviation);
  std::vector<float> image(kWidth * kHeight);
  for (float& value : image) value = error(random);
  return image;
}

enum class Along { kRows, kColumns, kBoth };

std::vector<float> weightedAlong(const std::vector<float>& image, bool columns,
                                 const std::vector<float>& weights) {
  std::vector<float> sums(image.size(), 0.0f);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    for (size_t k = 0; k < weights.size(); ++k) {  // wraps around at the border
      const int step = static_cast<int>(k);
      const int u = columns ? i % kWidth : (i % kWidth + step) % kWidth;
      const int v = columns ? (i / kWidth + step) % kHeight : i / kWidth;
      sums[i] += weights[k] * image[v * kWidth + u];
    }
  }
  return sums;
}

/// Filters an image with `weights` and scales it to a standard deviation of 0.001.
std::vector<float> smoothed(std::vector<float> image, const std::vector<float>& weights,
                            Along along = Along::kBoth) {
  if (along != Along::kColumns) image = weightedAlong(image, false, weights);
  if (along != Along::kRows) image = weightedAlong(image, true, weights);
  double squares = 0.0;
  for (const float value : image) squares += value * value;
  const double scale = 0.001 / std::sqrt(squares / static_cast<double>(image.size()));
  for (float& value : image) value *= static_cast<float>(scale);
  return image;
}

std::vector<float> bell(float sigma_px) {
  std::vector<float> weights(15);
  for (int k = 0; k < 15; ++k) {
    weights[k] = std::exp(-0.5f * (k - 7) * (k - 7) / (sigma_px * sigma_px));
  }
  return weights;
}

/// Cameras and their filters smooth the noise, so neighbouring pixels are correlated.
TEST(SensedNoise, IsFoundInSmoothedImages) {
  const std::vector<float> noise = whiteNoise(0.01f);
  for (const int side_px : {1, 3, 5, 7}) {
    const std::vector<float> mean(side_px, 1.0f);
    EXPECT_NEAR(estimatedNoise(smoothed(noise, mean)) / 0.001f, 1.0f, 0.15f) << side_px;
  }
  for (const float sigma_px : {0.5f, 1.0f, 1.5f, 2.0f}) {
    EXPECT_NEAR(estimatedNoise(smoothed(noise, bell(sigma_px))) / 0.001f, 1.0f, 0.15f) << sigma_px;
  }
}

/// The noise is correlated only along rows or columns, as in the scan lines of a lidar.
TEST(SensedNoise, IsFoundIfCorrelatedAlongLines) {
  const std::vector<float> noise = whiteNoise(0.01f);
  for (const Along along : {Along::kRows, Along::kColumns}) {
    const float found = estimatedNoise(smoothed(noise, bell(4.0f), along));
    EXPECT_NEAR(found / 0.001f, 1.0f, 0.15f) << static_cast<int>(along);
  }
}

/// Only an object of 19 x 19 pixels is measured, so only a few lines of pixels can be used.
TEST(SensedNoise, IsFoundOnASmallObject) {
  std::vector<float> offsets = whiteNoise(0.001f);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const bool is_object = std::abs(i % kWidth - 160) < 10 && std::abs(i / kWidth - 120) < 10;
    if (!is_object) offsets[i] = -0.5f;  // nothing measured
  }
  EXPECT_NEAR(estimatedNoise(offsets) / 0.001f, 1.0f, 0.3f);
}

/// The surface in the right half is rippled, with an amplitude of 4 mm at 2 m and a wavelength of
/// 24 pixels. The noise is 0.5 mm.
TEST(SensedNoise, DoesNotIncludeSurfaceDetail) {
  constexpr float kNoise = 1.25e-4f;
  std::vector<float> offsets = whiteNoise(kNoise);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = kWidth / 2; u < kWidth; ++u) {
      offsets[v * kWidth + u] += 0.001f * std::sin(2.0f * 3.14159265f * (u + v) / 24.0f);
    }
  }
  EXPECT_NEAR(estimatedNoise(offsets) / kNoise, 1.0f, 0.15f);
}

}  // namespace
}  // namespace dtsdf
