/// The estimate of a depth image's noise, against images whose noise is known.
#include "kernels/surfels/depth_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/fusion/ray_casting.h"

namespace dtsdf {
namespace {

constexpr float kDepthJump = 0.03f;

struct Line {
  float inverse_depth[kNoiseLength];
};

Line slantedLine() {
  Line line;
  for (int i = 0; i < kNoiseLength; ++i) line.inverse_depth[i] = 0.5f + 0.002f * i;
  return line;
}

TEST(DepthNoise, AStraightLineHasNone) {
  EXPECT_LT(varianceAboutLine(slantedLine().inverse_depth, kDepthJump), 1e-13f);
}

TEST(DepthNoise, MeanVarianceIsThatOfTheSamples) {
  std::mt19937 generator(1);
  for (const float noise : {0.0005f, 0.002f}) {
    std::normal_distribution<float> error(0.0f, noise);
    double sum = 0.0;
    constexpr int kLines = 4000;
    for (int n = 0; n < kLines; ++n) {
      Line line = slantedLine();
      for (float& sample : line.inverse_depth) sample += error(generator);
      const float variance = varianceAboutLine(line.inverse_depth, 1.0f);
      ASSERT_GE(variance, 0.0f);
      sum += variance;
    }
    // The mean of 4000 variances with five degrees of freedom scatters by 1 %.
    EXPECT_NEAR(std::sqrt(sum / kLines) / noise, 1.0, 0.03);
  }
}

TEST(DepthNoise, GapsAndJumpsAreNoNoise) {
  Line gap = slantedLine(), jump = slantedLine();
  gap.inverse_depth[5] = 0.0f;
  for (int i = 4; i < kNoiseLength; ++i) jump.inverse_depth[i] += 0.1f;
  EXPECT_LT(varianceAboutLine(gap.inverse_depth, kDepthJump), 0.0f);
  EXPECT_LT(varianceAboutLine(jump.inverse_depth, kDepthJump), 0.0f);
}

/// Beyond 2 m noise rules, below the share of the depth.
TEST(DepthNoise, NoiseAloneDisconnectsNothing) {
  EXPECT_TRUE(depthsConnected(1.0f / 5.0f, 1.0f / 5.0f - 0.014f, kDepthJump));   // 0.38 m at 5 m
  EXPECT_FALSE(depthsConnected(1.0f / 5.0f, 1.0f / 5.0f - 0.016f, kDepthJump));
  EXPECT_TRUE(depthsConnected(1.0f, 0.971f, kDepthJump));
  EXPECT_FALSE(depthsConnected(1.0f, 0.969f, kDepthJump));
}

TEST(DepthNoise, BinsKeepAnEighthOfTheDeviation) {
  for (float noise = 1e-6f; noise < 1.0f; noise *= 1.07f) {
    const int bin = noiseBin(noise * noise);
    ASSERT_GE(bin, 0);
    ASSERT_LT(bin, kNoiseBins);
    EXPECT_LE(noiseOfBin(bin), noise * 1.000001f);
    EXPECT_GT(noiseOfBin(bin), 0.88f * noise);
  }
}

TEST(DepthNoise, PointsLieInImagesOfAnySize) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {640, 480}, {4096, 2048}}) {
    for (int i = 0; i < kNoisePoints; ++i) {
      const NoisePoint at = noisePoint(i, width, height);
      ASSERT_TRUE(at.u >= 0 && at.u < width && at.v >= 0 && at.v < height);
    }
  }
}

/// What the noise is for: a window over which a plane's slope scatters less than the limit, in an
/// image with a focal length of 525 pixels at 2 m, checked by fitting planes to noise.
TEST(DepthNoise, WindowsKeepNormalsStill) {
  constexpr float kNoise = 0.0019f, kDepth_m = 2.0f, kFocal = 525.0f;
  const NormalFitSettings settings{16, kDepthJump, 0.0f, kFocal, kNoise};
  const int radius = windowRadius(1.0f / kDepth_m, settings);
  const auto slopeDeviation = [](int r) {  // of a plane's slope along the row, per unit of noise
    double spread = 0.0;
    for (int k = -r; k <= r; ++k) spread += static_cast<double>(k) * k * (2 * r + 1);
    return 1.0 / std::sqrt(spread);
  };
  const double turn = kNoise * kDepth_m * kFocal;  // per pixel's slope
  EXPECT_LE(turn * slopeDeviation(radius), 1.05 * kLargestTurn);
  EXPECT_GT(turn * slopeDeviation(radius - 1), kLargestTurn);
}

TEST(DepthNoise, ReachGrowsWithNoiseUpToTheTruncation) {
  EXPECT_EQ(sampleReach(4.0f, 0.0f), kSampleReach);
  EXPECT_FLOAT_EQ(sampleReach(4.0f, 1.0f), kNoiseReach);
  EXPECT_EQ(sampleReach(4.0f, 100.0f), 4.0f);
  EXPECT_EQ(sampleReach(1.0f, 0.0f), 1.0f);
}

}  // namespace
}  // namespace dtsdf
