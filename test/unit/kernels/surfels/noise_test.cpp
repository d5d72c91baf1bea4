/// Tests the noise estimated from single lines of depths, and the window size and maximum sample
/// distance derived from it.
#include "kernels/surfels/noise.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/fusion/sample_line.h"

namespace dtsdf {
namespace noise_test {

const SurfelSettings kSurfels{16, 0.03f, SurfelRules(), 0};

/// Time-of-flight noise is the same at every depth. At 2 m, where the inverse depth is 0.5/m, 3 mm
/// in depth are 3 mm * (0.5/m)^2 in inverse depth.
TEST(Noise, IsInDepthForTimeOfFlight) {
  const SurfelSettings flight{16, 0.03f, SurfelRules(), 1};
  float line[kNoiseLength];
  for (int i = 0; i < kNoiseLength; ++i) line[i] = 0.494f + 0.002f * i;  // 0.5 in the middle
  line[2] += 1e-3f;
  line[4] -= 1e-3f;
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

/// Lines across a depth edge do not count; lines across a smaller step do.
TEST(Noise, LinesAcrossEdgesDoNotCount) {
  SurfelSettings settings = kSurfels;
  settings.depth_jump = 0.1f;
  for (const float sign : {-1.0f, 1.0f}) {
    for (const float step : {0.05f, 0.2f}) {
      float line[kNoiseLength];
      for (int i = 0; i < kNoiseLength; ++i) line[i] = 1.0f + (i < 4 ? 0.0f : sign * step);
      EXPECT_EQ(noiseVariance(line, settings) < 0.0f, step > 0.1f) << step;
    }
  }
}

/// With this window, the scatter of the normal exceeds its limit by at most 5 %. With any smaller
/// window, it exceeds the limit.
TEST(Noise, WindowLimitsNormalScatter) {
  constexpr float kNoise = 0.0019f, kDepth_m = 2.0f, kFocal = 525.0f;
  FrameView frame{};
  frame.intrinsics.fx = kFocal;
  const FitWindow window = fitWindow(frame, {kNoise, 0}, kSurfels);
  const WindowRadius found = windowRadius(1.0f / kDepth_m, window);
  const int radius = found.both;
  EXPECT_EQ(found.one_side, radius);
  const auto slopeDeviation = [](int r) {  // along a row, per unit of noise
    double spread = 0.0;
    for (int k = -r; k <= r; ++k) spread += static_cast<double>(k) * k * (2 * r + 1);
    return 1.0 / std::sqrt(spread);
  };
  const double turn = kNoise * kDepth_m * kFocal;  // rotation of the normal per unit of slope
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

}  // namespace noise_test
}  // namespace dtsdf
