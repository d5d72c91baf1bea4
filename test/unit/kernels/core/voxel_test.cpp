#include "kernels/core/voxel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace dtsdf {
namespace {

constexpr float kTruncation = 4.0f;
constexpr float kNoCap = 1e9f;

TEST(VoxelSums, FixedPointStaysWithinItsBounds) {
  EXPECT_EQ(quantiseWeight(0.0f), 0);
  EXPECT_EQ(quantiseWeight(1.0f), 1 << 20);
  for (const float beyond : {1.0f, 1.5f, 1e30f, std::numeric_limits<float>::infinity()}) {
    EXPECT_EQ(quantiseSdf(beyond), 1 << 15);
    EXPECT_EQ(quantiseSdf(-beyond), -(1 << 15));
  }
}

/// The greatest image, every pixel with the greatest distance and the weight that a pixel's rounded
/// parts stay below, in one voxel.
TEST(VoxelSums, TheWorstFrameFits) {
  const int64_t weight = 2 * quantiseWeight(1.0f), sdf = quantiseSdf(1.0f);
  const int64_t limit = std::numeric_limits<int64_t>::max();
  EXPECT_LT(weight * sdf, limit / kMaxPixels);
  VoxelSums sums{weight * sdf * (kMaxPixels - 1), weight * (kMaxPixels - 1)};
  addToSums(sums, static_cast<int32_t>(weight), static_cast<int32_t>(sdf));
  const Voxel voxel = foldSums({0.0f, 0.0f}, sums, kTruncation, kNoCap);
  EXPECT_FLOAT_EQ(voxel.sdf, kTruncation);
  EXPECT_FLOAT_EQ(voxel.weight, 2.0f * static_cast<float>(kMaxPixels));
}

TEST(VoxelSums, QuantisingRoundsToTheNearest) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  for (int i = 0; i < 10000; ++i) {
    const float x = uniform(random);
    EXPECT_NEAR(quantiseSdf(x) / 32768.0, x, 0.5 / 32768.0 + 1e-9);
    EXPECT_NEAR(quantiseWeight(std::abs(x)) / 1048576.0, std::abs(x), 0.5 / 1048576.0 + 1e-7);
  }
}

TEST(FoldSums, WithoutAMeasurementTheVoxelStays) {
  const Voxel before{-1.25f, 3.5f};
  const Voxel after = foldSums(before, {0, 0}, kTruncation, kNoCap);
  EXPECT_EQ(after.sdf, before.sdf);
  EXPECT_EQ(after.weight, before.weight);
  EXPECT_EQ(foldSums({0.0f, 0.0f}, {0, 0}, kTruncation, kNoCap).weight, 0.0f);
}

/// Frames one by one give the weighted mean of all their measurements.
TEST(FoldSums, IsTheWeightedMean) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> distance(-1.0f, 1.0f), weight(0.01f, 1.0f);
  Voxel voxel{0.0f, 0.0f};
  double sum = 0.0, sum_weight = 0.0;
  for (int frame = 0; frame < 50; ++frame) {
    VoxelSums sums{0, 0};
    for (int pixel = 0; pixel < 20; ++pixel) {
      const float w = weight(random), d = distance(random);
      addToSums(sums, quantiseWeight(w), quantiseSdf(d));
      sum += static_cast<double>(w) * d * kTruncation;
      sum_weight += w;
    }
    voxel = foldSums(voxel, sums, kTruncation, kNoCap);
  }
  EXPECT_NEAR(voxel.weight, sum_weight, 1e-4 * sum_weight);
  EXPECT_NEAR(voxel.sdf, sum / sum_weight, 1e-4 * kTruncation);
}

TEST(FoldSums, OrderOfTheMeasurementsDoesNotMatter) {
  std::mt19937 random(10);
  std::uniform_real_distribution<float> distance(-1.0f, 1.0f), weight(0.0f, 1.0f);
  std::vector<std::pair<int32_t, int32_t>> measurements;
  for (int i = 0; i < 1000; ++i) {
    measurements.emplace_back(quantiseWeight(weight(random)), quantiseSdf(distance(random)));
  }
  const auto sumUp = [&] {
    VoxelSums sums{0, 0};
    for (const auto& [w, d] : measurements) addToSums(sums, w, d);
    return sums;
  };
  const VoxelSums first = sumUp();
  std::shuffle(measurements.begin(), measurements.end(), random);
  const VoxelSums second = sumUp();
  EXPECT_EQ(first.weighted_sdf, second.weighted_sdf);
  EXPECT_EQ(first.weight, second.weight);
}

TEST(FoldSums, TheCapLetsNewMeasurementsThrough) {
  VoxelSums near{0, 0};
  addToSums(near, quantiseWeight(1.0f), quantiseSdf(0.5f));
  Voxel voxel{-2.0f, 100.0f};
  voxel = foldSums(voxel, near, kTruncation, 3.0f);
  EXPECT_EQ(voxel.weight, 3.0f);
  for (int i = 0; i < 40; ++i) voxel = foldSums(voxel, near, kTruncation, 3.0f);
  EXPECT_EQ(voxel.weight, 3.0f);
  EXPECT_NEAR(voxel.sdf, 0.5f * kTruncation, 1e-3);
}

}  // namespace
}  // namespace dtsdf
