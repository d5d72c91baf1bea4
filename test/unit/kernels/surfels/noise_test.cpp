/// The estimate of a depth image's noise, against images whose noise is known.
#include "kernels/surfels/noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/fusion/sample_line.h"

namespace dtsdf {
namespace {

const SurfelSettings kSurfels{16, 0.03f, SurfelRules()};

struct Line {
  float inverse_depth[kNoiseLength];
};

Line slantedLine() {
  Line line;
  for (int i = 0; i < kNoiseLength; ++i) line.inverse_depth[i] = 0.5f + 0.002f * i;
  return line;
}

TEST(Noise, AStraightLineHasNone) {
  EXPECT_LT(varianceAboutLine(slantedLine().inverse_depth, kSurfels), 1e-13f);
}

TEST(Noise, MeanVarianceIsThatOfTheSamples) {
  std::mt19937 generator(1);
  for (const float noise : {0.0005f, 0.002f}) {
    std::normal_distribution<float> error(0.0f, noise);
    double sum = 0.0;
    constexpr int kLines = 4000;
    for (int n = 0; n < kLines; ++n) {
      Line line = slantedLine();
      for (float& sample : line.inverse_depth) sample += error(generator);
      const float variance = varianceAboutLine(line.inverse_depth, {16, 1.0f, SurfelRules()});
      ASSERT_GE(variance, 0.0f);
      sum += variance;
    }
    // The mean of 4000 variances with five degrees of freedom scatters by 1 %.
    EXPECT_NEAR(std::sqrt(sum / kLines) / noise, 1.0, 0.03);
  }
}

TEST(Noise, GapsAndJumpsAreNoNoise) {
  Line gap = slantedLine(), jump = slantedLine();
  gap.inverse_depth[5] = 0.0f;
  for (int i = 4; i < kNoiseLength; ++i) jump.inverse_depth[i] += 0.1f;
  EXPECT_LT(varianceAboutLine(gap.inverse_depth, kSurfels), 0.0f);
  EXPECT_LT(varianceAboutLine(jump.inverse_depth, kSurfels), 0.0f);
}

/// Beyond 2 m noise rules, below the share of the depth.
TEST(Noise, NoiseAloneDisconnectsNothing) {
  EXPECT_TRUE(depthsConnected(1.0f / 5.0f, 1.0f / 5.0f - 0.014f, kSurfels));   // 0.38 m at 5 m
  EXPECT_FALSE(depthsConnected(1.0f / 5.0f, 1.0f / 5.0f - 0.016f, kSurfels));
  EXPECT_TRUE(depthsConnected(1.0f, 0.971f, kSurfels));
  EXPECT_FALSE(depthsConnected(1.0f, 0.969f, kSurfels));
}

TEST(Noise, BinsKeepAnEighthOfTheDeviation) {
  for (float noise = 1e-6f; noise < 1.0f; noise *= 1.07f) {
    const int bin = noiseBin(noise * noise);
    ASSERT_GE(bin, 0);
    ASSERT_LT(bin, kNoiseBins);
    EXPECT_LE(noiseOfBin(bin), noise * 1.000001f);
    EXPECT_GT(noiseOfBin(bin), 0.88f * noise);
  }
}

TEST(Noise, PointsLieInImagesOfAnySize) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {640, 480}, {4096, 2048}}) {
    for (int i = 0; i < kNoisePoints; ++i) {
      const Pixel at = noisePoint(i, width, height);
      ASSERT_TRUE(at.u >= 0 && at.u < width && at.v >= 0 && at.v < height);
    }
  }
}

/// What the noise is for: a window over which a plane's slope scatters less than the limit, in an
/// image with a focal length of 525 pixels at 2 m, checked by fitting planes to noise.
TEST(Noise, WindowsKeepNormalsStill) {
  constexpr float kNoise = 0.0019f, kDepth_m = 2.0f, kFocal = 525.0f;
  FrameView frame{};
  frame.intrinsics.fx = kFocal;
  const FitWindow window = fitWindow(frame, kNoise, kSurfels);
  const int radius = windowRadius(1.0f / kDepth_m, window);
  const auto slopeDeviation = [](int r) {  // of a plane's slope along the row, per unit of noise
    double spread = 0.0;
    for (int k = -r; k <= r; ++k) spread += static_cast<double>(k) * k * (2 * r + 1);
    return 1.0 / std::sqrt(spread);
  };
  const double turn = kNoise * kDepth_m * kFocal;  // per pixel's slope
  EXPECT_LE(turn * slopeDeviation(radius), 1.05 * kSurfels.rules.largest_noise_turn);
  EXPECT_GT(turn * slopeDeviation(radius - 1), kSurfels.rules.largest_noise_turn);
}

TEST(Noise, ReachGrowsWithNoiseUpToTheTruncation) {
  const FusionRules rules;
  const FusionSettings fusion{1, 1, 4.0f, 1e6f, rules}, narrow{1, 1, 1.0f, 1e6f, rules};
  EXPECT_EQ(sampleReach(0.0f, fusion), rules.sample_reach);
  EXPECT_FLOAT_EQ(sampleReach(1.0f, fusion), rules.noise_reach);
  EXPECT_EQ(sampleReach(100.0f, fusion), 4.0f);
  EXPECT_EQ(sampleReach(0.0f, narrow), 1.0f);
}

}  // namespace
}  // namespace dtsdf
