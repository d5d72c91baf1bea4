// What the CPU senses of many pixels at once against the rules for each on its own, bit for bit.
#include "cpu/sense.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "kernels/fusion/free_space.h"
#include "kernels/surfels/depth.h"
#include "support/links_of_image.h"

namespace dtsdf {
namespace {

/// Slopes, noise, jumps, gaps, blanks and pixels beyond the range, in 16 bits of 0.2 mm. Most rows
/// are blank but for a span.
std::vector<uint16_t> randomImage(int width, int height, uint32_t seed, const PixelSpan& span) {
  std::mt19937 random(seed);
  std::vector<uint16_t> image;
  for (int i = 0; i < width * height; ++i) {
    const int u = i % width, v = i / width;
    const uint32_t jump = u % 23 > 11 ? 3000 : 0, side = v % 9 > 4 ? 60 * (u % 7) : 3 * u;
    const bool is_blank = v == 3 || (v > 5 && (u < span.begin || u >= span.end));
    const uint32_t kind = is_blank ? 0 : random() % 40;
    const uint32_t raw = kind == 0 ? 0 : (kind == 1 ? 65535 : (kind == 2 ? 60000 : 5000));
    image.push_back(static_cast<uint16_t>(raw == 5000 ? raw + jump + side + random() % 8 : raw));
  }
  return image;
}

TEST(Sense, HasTheBitsOfTheRulesPixelByPixel) {
  constexpr int kRows = 11;
  const MapperParams params;
  FrameSensor sensor(params, Rules(), 2);  // one for images of all sizes
  // Less, more or elsewhere in the same rows, of which nothing may stay.
  const std::vector<std::pair<int, PixelSpan>> images = {
      {130, {40, 101}}, {130, {64, 80}}, {130, {0, 30}}, {130, {5, 130}}, {130, {0, 0}},
      {1, {0, 1}},      {2, {0, 2}},     {3, {0, 3}},    {65, {40, 65}},  {130, {40, 101}}};
  for (const auto& [columns, span] : images) {
    const int width = columns;
    const std::vector<uint16_t> image = randomImage(width, kRows, 7 + width, span);
    DepthFrame frame;
    frame.data = image.data();
    frame.width = width;
    frame.height = kRows;
    frame.row_bytes = width * sizeof(uint16_t);
    frame.encoding = DepthEncoding::kUint16;
    frame.unit_m = 0.0002f;
    frame.intrinsics = {500.0f, 500.0f, 0.5f * width, 0.5f * kRows};
    const FrameSensing sensing = sensor.sense(frame);
    const size_t count = image.size();
    const float* inverse = sensing.image.inverse_depth;
    const DepthRange range = depthRangeOf(frame, params);
    const auto measured = [&](int u, int v) {
      const float depth_m = static_cast<float>(image[v * width + u]) * frame.unit_m;
      const bool is_measured = depth_m > 0.0f && image[v * width + u] < 65535;
      const float sign = depth_m > range.max_m ? -1.0f : 1.0f;
      return is_measured ? sign / depth_m : 0.0f;
    };
    const GapLimits limits =
        gapLimits(makeSurfelSettings(params, SurfelRules()), range, sensing.noise);
    for (size_t i = 0; i < count; ++i) {
      const Pixel pixel{static_cast<int>(i) % width, static_cast<int>(i) / width};
      ASSERT_EQ(inverse[i], filledInverseDepth(measured, width, kRows, pixel, limits)) << i;
    }
    const std::vector<PixelLinks> links =
        linksOfImage(sensing.image.frame, std::vector<float>(inverse, inverse + count),
                     sensing.noise, makeSurfelSettings(params, SurfelRules()));
    for (size_t i = 0; i < count; ++i) {
      ASSERT_EQ(sensing.image.links[i], links[i]) << i;
      ASSERT_TRUE(inverse[i] > 0.0f || sensing.image.row_value[i] == 0.0f) << i;
      ASSERT_TRUE(inverse[i] > 0.0f || sensing.image.row_slope[i] == 0.0f) << i;
      const Pixel pixel{static_cast<int>(i) % width, static_cast<int>(i) / width};
      ASSERT_EQ(sensing.free_depth[i],
                freeDepth(sensing, pixel, makeFusionSettings(params, Rules())))
          << i;
    }
  }
}

constexpr int kWidth = 320, kHeight = 240;

/// Of an image of these inverse depths, around 0.5 1/m.
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
    for (size_t k = 0; k < weights.size(); ++k) {  // on from the other side at the end
      const int step = static_cast<int>(k);
      const int u = columns ? i % kWidth : (i % kWidth + step) % kWidth;
      const int v = columns ? (i / kWidth + step) % kHeight : i / kWidth;
      sums[i] += weights[k] * image[v * kWidth + u];
    }
  }
  return sums;
}

/// Scaled to a deviation of 0.001.
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

/// As cameras and filters leave it.
TEST(SensedNoise, IsThatOfSmoothedImages) {
  const std::vector<float> noise = whiteNoise(0.01f);
  for (const int side_px : {1, 3, 5, 7}) {
    const std::vector<float> mean(side_px, 1.0f);
    EXPECT_NEAR(estimatedNoise(smoothed(noise, mean)) / 0.001f, 1.0f, 0.15f) << side_px;
  }
  for (const float sigma_px : {0.5f, 1.0f, 1.5f, 2.0f}) {
    EXPECT_NEAR(estimatedNoise(smoothed(noise, bell(sigma_px))) / 0.001f, 1.0f, 0.15f) << sigma_px;
  }
}

/// Neighbours share it in a row or in a column only, as by the lines of a lidar.
TEST(SensedNoise, IsThatOfRowsOrColumns) {
  const std::vector<float> noise = whiteNoise(0.01f);
  for (const Along along : {Along::kRows, Along::kColumns}) {
    const float found = estimatedNoise(smoothed(noise, bell(4.0f), along));
    EXPECT_NEAR(found / 0.001f, 1.0f, 0.15f) << static_cast<int>(along);
  }
}

/// Of an object 20 pixels wide, which has few lines.
TEST(SensedNoise, IsThatOfASmallObject) {
  std::vector<float> offsets = whiteNoise(0.001f);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const bool is_object = std::abs(i % kWidth - 160) < 10 && std::abs(i / kWidth - 120) < 10;
    if (!is_object) offsets[i] = -0.5f;  // nothing measured
  }
  EXPECT_NEAR(estimatedNoise(offsets) / 0.001f, 1.0f, 0.3f);
}

/// Ripples of 4 mm at 2 m, 24 pixels long, over the right half, in noise of half a millimetre.
TEST(SensedNoise, IsNotTheDetailOfSurfaces) {
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
