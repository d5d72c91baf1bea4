/// The estimate of a depth image's noise, against images whose noise is known.
#include "kernels/surfels/noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "kernels/fusion/sample_line.h"

namespace dtsdf {
namespace noise_test {

const SurfelSettings kSurfels{16, 0.03f, SurfelRules(), 0};

NoiseLine slantedLine() {
  NoiseLine line;
  for (int i = 0; i < kNoiseLength; ++i) line.inverse_depth[i] = 0.5f + 0.002f * i;
  return line;
}

/// Of many lines in noise: the variance that each quartile shows, to the width of a bin.
TEST(Noise, QuartilesAreThoseOfTheSamples) {
  std::mt19937 generator(2);
  std::normal_distribution<float> error(0.0f, 0.001f);
  std::vector<float> variances(10001);
  for (float& variance : variances) {
    NoiseLine line = slantedLine();
    for (float& sample : line.inverse_depth) sample += error(generator);
    variance = noiseVariance(line, kSurfels);
  }
  std::sort(variances.begin(), variances.end());
  for (int quartile = 0; quartile < kNoiseQuartiles; ++quartile) {
    const int bin = noiseBin(variances[quartileRank(10001, quartile)]);
    const float found = noiseOfBin(bin, quartile) / 1e-6f;
    EXPECT_GT(found, 0.83f) << quartile;
    EXPECT_LT(found, 1.06f) << quartile;
  }
}

TEST(Noise, MeanVarianceIsThatOfTheSamples) {
  std::mt19937 generator(1);
  for (const float noise : {0.0005f, 0.002f}) {
    std::normal_distribution<float> error(0.0f, noise);
    double sum = 0.0;
    constexpr int kLines = 10000;
    for (int n = 0; n < kLines; ++n) {
      NoiseLine line = slantedLine();
      for (float& sample : line.inverse_depth) sample += error(generator);
      const float variance = noiseVariance(line, kSurfels);
      ASSERT_GE(variance, 0.0f);
      sum += variance;
    }
    // The mean of 10000 variances with two degrees of freedom scatters by 1 %.
    EXPECT_NEAR(sum / kLines / (noise * noise), 1.0, 0.04);
  }
}

/// Time of flight: 3 mm at 2 m is a deviation of 3 mm * (0.5 1/m)^2 of inverse depth there.
TEST(Noise, IsThatOfDepthForTimeOfFlight) {
  const SurfelSettings flight{16, 0.03f, SurfelRules(), 1};
  NoiseLine line = slantedLine();
  for (float& sample : line.inverse_depth) sample -= 0.006f;  // 0.5 in the middle
  line.inverse_depth[2] += 1e-3f;
  line.inverse_depth[4] -= 1e-3f;
  EXPECT_FLOAT_EQ(noiseVariance(line, flight), 16.0f * noiseVariance(line, kSurfels));
  EXPECT_FLOAT_EQ(noiseAt({0.003f, 1}, 0.5f), 0.00075f);
  EXPECT_FLOAT_EQ(noiseAt({0.003f, 0}, 0.5f), 0.003f);
  FrameSensing sensing{};
  sensing.image.frame.voxel_size_m = 0.01f;
  sensing.noise = {0.003f, 1};
  EXPECT_FLOAT_EQ(noiseInVoxels(sensing, 1.0f), 0.3f);
  EXPECT_FLOAT_EQ(noiseInVoxels(sensing, 4.0f), 0.3f);
  sensing.noise.in_depth = 0;
  EXPECT_FLOAT_EQ(noiseInVoxels(sensing, 4.0f), 4.8f);
}

TEST(Noise, LinesWithGapsDoNotCount) {
  for (int i = 0; i < kNoiseLength; ++i) {
    for (const float none : {0.0f, -0.5f}) {
      NoiseLine gap = slantedLine();
      gap.inverse_depth[i] = none;
      EXPECT_LT(noiseVariance(gap, kSurfels), 0.0f) << i;
    }
  }
}

/// Across an edge there is no telling noise; a step that noise may make is none.
TEST(Noise, LinesAcrossEdgesDoNotCount) {
  SurfelSettings settings = kSurfels;
  settings.depth_jump = 0.1f;
  for (const float sign : {-1.0f, 1.0f}) {
    for (const float step : {0.05f, 0.2f}) {
      NoiseLine line;
      for (int i = 0; i < kNoiseLength; ++i) {
        line.inverse_depth[i] = 1.0f + (i < 4 ? 0.0f : sign * step);
      }
      EXPECT_EQ(noiseVariance(line, settings) < 0.0f, step > 0.1f) << step;
    }
  }
}

/// In variances: what short lines show in the median; what longer ones have in common, the longest
/// up to nine times that; detail counts for nothing, nor do few lines. Rows and columns count on
/// their own.
TEST(Noise, ThatNeighboursShareCounts) {
  const SurfelRules rules;
  const auto all = [](float noise) { return NoiseOfLines{{noise, noise, noise}, 100}; };
  const auto variance = [&](const NoiseOfLines& step, const NoiseOfLines& three,
                            const NoiseOfLines& seven) {
    const float rows = combinedNoise({three, all(0.1f), seven, all(0.1f), step}, rules);
    const float columns = combinedNoise({all(0.1f), three, all(0.1f), seven, step}, rules);
    EXPECT_EQ(rows, columns);
    return rows * rows;
  };
  EXPECT_FLOAT_EQ(variance(all(1.0f), all(0.5f), all(0.75f)), 1.0f);
  EXPECT_FLOAT_EQ(variance({{0.5f, 1.0f, 2.0f}, 1}, all(0.5f), all(0.75f)), 1.0f);
  EXPECT_FLOAT_EQ(variance(all(1.0f), all(2.0f), all(0.5f)), 2.0f);
  EXPECT_FLOAT_EQ(variance(all(1.0f), all(2.0f), all(17.0f)), 17.0f);
  EXPECT_FLOAT_EQ(variance(all(1.0f), all(2.0f), all(20.0f)), 18.0f);
  EXPECT_FLOAT_EQ(variance(all(1.0f), {{3.0f, 3.5f, 4.0f}, 16}, {{5.0f, 6.0f, 6.5f}, 16}), 3.5f);
  EXPECT_FLOAT_EQ(variance(all(1.0f), {{3.0f, 3.5f, 4.0f}, 15}, {{5.0f, 6.0f, 6.5f}, 15}), 1.0f);
  EXPECT_FLOAT_EQ(variance(all(1.0f), {{3.0f, 5.0f, 7.0f}, 99}, {{5.0f, 6.0f, 11.0f}, 99}), 1.0f);
  EXPECT_FLOAT_EQ(variance(all(1.0f), {{3.0f, 2.0f, 1.0f}, 99}, all(0.0f)), 2.0f);
  EXPECT_EQ(combinedNoise({all(0.0f), all(0.0f), all(9.0f), all(9.0f), all(0.0f)}, rules), 0.0f);
}

/// In an image of 9 x 9 with empty columns, as registered images have: the line goes on over gaps
/// of a pixel, and is none where one is wider.
TEST(Noise, LinesGoOnOverGaps) {
  std::vector<float> image(81);
  for (int i = 0; i < 81; ++i) image[i] = i % 3 == 0 ? 0.0f : 1.0f + 0.001f * (i % 9);
  const auto line = [&] {
    const auto at = [&](int u, int v) { return image[static_cast<size_t>(v * 9 + u)]; };
    return noiseLine(at, 9, 9, {{4, 4}, 1, false, 0});
  };
  for (int i = 0; i < kNoiseLength; ++i) {
    EXPECT_FLOAT_EQ(line().inverse_depth[i], 1.0f + 0.001f * (i + 1)) << i;
  }
  for (int v = 0; v < 9; ++v) image[v * 9 + 5] = 0.0f;
  for (const float value : line().inverse_depth) EXPECT_EQ(value, 0.0f);
}

/// In an image of 50 x 50 whose value shows the pixel, about its pixel (25, 25): three samples to
/// each side, one pixel apart or seven.
TEST(Noise, LinesLieInRowsAndColumns) {
  std::vector<float> image(2500);
  for (int i = 0; i < 2500; ++i) image[i] = static_cast<float>(i + 1);
  const auto first = [&](const NoiseLinePlace& place) {
    const auto at = [&](int u, int v) { return image[static_cast<size_t>(v * 50 + u)]; };
    return noiseLine(at, 50, 50, place).inverse_depth[0];
  };
  EXPECT_EQ(first({{25, 25}, 1, false, 0}), 1273.0f);
  EXPECT_EQ(first({{25, 25}, 7, false, 0}), 1255.0f);
  EXPECT_EQ(first({{25, 25}, 7, true, 0}), 226.0f);
  EXPECT_EQ(first({{2, 25}, 1, false, 0}), 0.0f);
  EXPECT_EQ(first({{47, 25}, 1, false, 0}), 0.0f);
  EXPECT_EQ(first({{20, 25}, 7, false, 0}), 0.0f);
  EXPECT_EQ(first({{29, 25}, 7, false, 0}), 0.0f);
  EXPECT_EQ(first({{25, 20}, 7, true, 0}), 0.0f);
  EXPECT_EQ(first({{25, 29}, 7, true, 0}), 0.0f);
}

TEST(Noise, BinsKeepASixteenthOfTheDeviation) {
  for (float noise = 1e-6f; noise < 1.0f; noise *= 1.07f) {
    const int bin = noiseBin(noise * noise);
    ASSERT_GE(bin, 0);
    ASSERT_LT(bin, kNoiseBins);
    const float found = std::sqrt(std::log(2.0f) * noiseOfBin(bin, 1));  // at the median
    EXPECT_LE(found, noise * 1.000001f);
    EXPECT_GT(found, 0.94f * noise);
  }
}

TEST(Noise, PointsLieInImagesOfAnySize) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {640, 480}, {4096, 2048}}) {
    for (int i = 0; i < kNoisePoints; ++i) {
      const NoiseLinePlace place = noiseLinePlace(i, 0, width, height);
      const Pixel at = place.middle;
      ASSERT_TRUE(at.u >= 0 && at.u < width && at.v >= 0 && at.v < height);
      ASSERT_EQ(place.is_column, noiseLinePlace(i, 2, width, height).is_column);
      ASSERT_EQ(place.kind, place.is_column ? 1 : 0);
    }
  }
}

/// What the noise is for: a window over which a plane's slope scatters less than the limit, in an
/// image with a focal length of 525 pixels at 2 m, checked by fitting planes to noise.
TEST(Noise, WindowsKeepNormalsStill) {
  constexpr float kNoise = 0.0019f, kDepth_m = 2.0f, kFocal = 525.0f;
  FrameView frame{};
  frame.intrinsics.fx = kFocal;
  const FitWindow window = fitWindow(frame, {kNoise, 0}, kSurfels);
  const WindowRadius found = windowRadius(1.0f / kDepth_m, window);
  const int radius = found.both;
  EXPECT_EQ(found.one_side, radius);
  const auto slopeDeviation = [](int r) {  // of a plane's slope along the row, per unit of noise
    double spread = 0.0;
    for (int k = -r; k <= r; ++k) spread += static_cast<double>(k) * k * (2 * r + 1);
    return 1.0 / std::sqrt(spread);
  };
  const double turn = kNoise * kDepth_m * kFocal;  // per pixel's slope
  EXPECT_LE(turn * slopeDeviation(radius), 1.05 * kSurfels.rules.largest_noise_turn);
  EXPECT_GT(turn * slopeDeviation(radius - 1), kSurfels.rules.largest_noise_turn);
}

/// A gap at the rim has a pixel on one side only.
TEST(NoiseLine, EndsWithTheImage) {
  constexpr int kSide = 2 * kNoiseRadius + 1;
  for (const int gap : {0, kSide - 1}) {
    const auto at = [gap](int u, int) {
      EXPECT_TRUE(u >= 0 && u < kSide) << u;
      return u == gap ? 0.0f : 0.5f;
    };
    const NoiseLinePlace place{{kNoiseRadius, kNoiseRadius}, 1, false, 0};
    EXPECT_EQ(noiseLine(at, kSide, kSide, place).inverse_depth[1], 0.0f);
  }
}

TEST(Noise, ReachGrowsWithNoiseUpToTheTruncation) {
  const FusionRules rules;
  const FusionSettings fusion{1, 1, 4.0f, 1e6f, rules}, narrow{1, 1, 1.0f, 1e6f, rules};
  EXPECT_EQ(sampleReach(0.0f, fusion), rules.sample_reach);
  EXPECT_FLOAT_EQ(sampleReach(1.0f, fusion), rules.noise_reach);
  EXPECT_EQ(sampleReach(100.0f, fusion), 4.0f);
  EXPECT_EQ(sampleReach(0.0f, narrow), 1.0f);
}

}  // namespace noise_test
}  // namespace dtsdf
