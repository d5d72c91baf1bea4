/// Tests the noise models of time-of-flight and stereo cameras against values computed by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "evaluation/depth_noise.h"
#include "evaluation/mixed_pixels.h"
#include "evaluation/stereo_noise.h"

namespace dtsdf {
namespace {

constexpr int kWidth = 300, kHeight = 40;

/// With this focal length and a baseline of 50 mm, the disparity is 26.25 / z pixels.
ViewCamera camera() { return {{525.0f, 525.0f, 149.5f, 19.5f}, kWidth, kHeight}; }

/// A view at normal incidence with one depth per column.
template <class DepthOfColumn>
DepthView viewOf(DepthOfColumn depth) {
  DepthView view;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) view.depth_m.push_back(depth(u));
  }
  view.incidence_cosine.assign(view.depth_m.size(), 1.0f);
  return view;
}

DepthView wall(float z_m) {
  return viewOf([=](int) { return z_m; });
}

/// Standard deviation of the noisy depths of a wall. Missing pixels are ignored.
double sigmaOf(DepthNoise noise, float wall_m) {
  double squares = 0.0;
  int count = 0;
  for (const float z_m : addNoise(wall(wall_m), camera(), noise, 1)) {
    if (z_m <= 0.0f) continue;
    squares += std::pow(static_cast<double>(z_m - wall_m), 2);
    ++count;
  }
  return std::sqrt(squares / count);
}

TEST(DepthNoiseModels, SameSeedGivesSameNoise) {
  const DepthView view = viewOf([](int u) { return u < 150 ? 1.0f : 2.0f; });
  for (const char* name : {"kinect", "tof", "stereo"}) {
    const auto noisy = [&](uint64_t seed) {
      return addNoise(view, camera(), depthNoiseFromName(name), seed);
    };
    EXPECT_EQ(noisy(5), noisy(5)) << name;
    EXPECT_NE(noisy(5), noisy(6)) << name;
  }
}

/// The published values at normal incidence are 1.3 mm at 1 m, 1.7 mm at 2 m and 4.3 mm at 4 m.
TEST(DepthNoiseModels, TimeOfFlightFollowsTheCitedFormula) {
  EXPECT_NEAR(tofAxialSigma(1.0, 0.0), 0.0013, 1e-12);
  EXPECT_NEAR(tofAxialSigma(2.0, 0.0), 0.0017, 1e-12);
  EXPECT_NEAR(tofAxialSigma(4.0, 0.0), 0.0043, 1e-12);
  const double eighth_turn = std::atan(1.0);  // 45 degrees: the slant term is 1
  EXPECT_NEAR(tofAxialSigma(4.0, eighth_turn), 0.0043 + 0.0008, 1e-12);
  EXPECT_TRUE(std::isfinite(tofAxialSigma(4.0, 1.5707963)));
  EXPECT_NEAR(sigmaOf(DepthNoise::kTof, 2.0f), 0.0017, 5e-5);
}

/// Half of the pixel receives light from 1 m, and half from 3 m with a ninth of the amplitude, so
/// the depth is (1 + 3 / 9) / (1 + 1 / 9) = 1.2 m.
TEST(DepthNoiseModels, MixedDepthsAreWeightedByAmplitude) {
  EXPECT_NEAR(mixDepths(1.0f, 3.0f, 0.5f), 1.2f, 1e-6f);
  EXPECT_NEAR(mixDepths(3.0f, 1.0f, 0.5f), 1.2f, 1e-6f);
  EXPECT_FLOAT_EQ(mixDepths(1.0f, 3.0f, 0.0f), 1.0f);
}

TEST(DepthNoiseModels, PixelsMixOnlyAtEdges) {
  const DepthView view = viewOf([](int u) { return u < 100 ? 0.0f : u < 150 ? 1.0f : 3.0f; });
  const auto mixed_m = mixPixels(view.depth_m, camera(), 1);
  size_t in_between = 0;
  for (size_t i = 0; i < mixed_m.size(); ++i) {
    const size_t u = i % kWidth;
    if (u == 149 || u == 150) {
      ASSERT_GE(mixed_m[i], u == 149 ? 1.0f : 1.2f)
          << "at most half of a pixel should belong to the other surface";
      ASSERT_LE(mixed_m[i], u == 149 ? 1.2f : 3.0f);
      if (mixed_m[i] > 1.02f && mixed_m[i] < 2.98f) ++in_between;
    } else {
      ASSERT_EQ(mixed_m[i], view.depth_m[i]) << "column " << u;
    }
  }
  EXPECT_GT(in_between, 40u) << "more than half of the 80 mixed pixels should be in between";
}

/// A standard deviation of 0.08 pixels corresponds to 2^2 * 0.08 / 26.25 = 12.2 mm at 2 m.
TEST(DepthNoiseModels, DisparityNoiseGrowsWithTheSquareOfTheDepth) {
  EXPECT_NEAR(sigmaOf(DepthNoise::kStereo, 2.0f), 0.0122, 0.0015);
  EXPECT_NEAR(sigmaOf(DepthNoise::kStereo, 1.0f), 0.00305, 0.0004);
}

TEST(DepthNoiseModels, DisparityIsQuantised) {
  const DepthView view = viewOf([](int u) { return 1.0f + 0.01f * static_cast<float>(u); });
  for (const float z_m : addNoise(view, camera(), DepthNoise::kStereo, 1)) {
    if (z_m <= 0.0f) continue;
    const double steps = 26.25 / static_cast<double>(z_m) * 32.0;
    ASSERT_NEAR(steps, std::round(steps), 1e-3);
  }
}

/// The object in columns 100 to 199 has a disparity of 20 pixels, and the wall behind it 5 pixels.
/// In the right image, the object is in columns 80 to 179, where it occludes columns 85 to 99 of
/// the wall. The first five columns of the wall are outside the right image.
TEST(DepthNoiseModels, PixelsHiddenFromTheSecondCameraAreLost) {
  const float near_m = 26.25f / 20.0f, far_m = 26.25f / 5.0f;
  const DepthView view = viewOf([=](int u) { return u >= 100 && u < 200 ? near_m : far_m; });
  const std::vector<bool> seen = seenByBoth(view.depth_m, camera());
  for (size_t i = 0; i < seen.size(); ++i) {
    const size_t u = i % kWidth;
    const bool lost = u < 5 || (u >= 85 && u < 100);
    ASSERT_EQ(seen[i], !lost) << "column " << u;
  }
}

}  // namespace
}  // namespace dtsdf
