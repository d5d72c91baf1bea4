// Folding a frame's sums into voxels, against the weighted mean in double precision.
#include "kernels/fusion/voxel_update.h"

#include <gtest/gtest.h>

#include <random>

namespace dtsdf {
namespace {

constexpr float kTruncation = 4.0f;
const FusionSettings kUncapped{1, 1, kTruncation, 1e9f, FusionRules()};

/// The worst frame of all: kMaxPixels pixels of twice the greatest weight, at the truncation.
TEST(FoldSums, TheWorstFrameFits) {
  const int64_t weight = int64_t{2} * kMaxPixels << 20;
  const Voxel voxel = foldSums({0.0f, 0.0f}, {weight << 15, weight}, kUncapped);
  EXPECT_FLOAT_EQ(voxel.sdf, kTruncation);
  EXPECT_FLOAT_EQ(voxel.weight, 2.0f * static_cast<float>(kMaxPixels));
}

TEST(FoldSums, WithoutAMeasurementTheVoxelStays) {
  const Voxel before{-1.25f, 3.5f};
  const Voxel after = foldSums(before, {0, 0}, kUncapped);
  EXPECT_EQ(after.sdf, before.sdf);
  EXPECT_EQ(after.weight, before.weight);
  EXPECT_EQ(foldSums({0.0f, 0.0f}, {0, 0}, kUncapped).weight, 0.0f);
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
    voxel = foldSums(voxel, sums, kUncapped);
  }
  EXPECT_NEAR(voxel.weight, sum_weight, 1e-4 * sum_weight);
  EXPECT_NEAR(voxel.sdf, sum / sum_weight, 1e-4 * kTruncation);
}

TEST(FoldSums, TheCapLetsNewMeasurementsThrough) {
  VoxelSums near{0, 0};
  addToSums(near, quantiseWeight(1.0f), quantiseSdf(0.5f));
  const FusionSettings capped{1, 1, kTruncation, 3.0f, FusionRules()};
  Voxel voxel{-2.0f, 100.0f};
  voxel = foldSums(voxel, near, capped);
  EXPECT_EQ(voxel.weight, 3.0f);
  for (int i = 0; i < 40; ++i) voxel = foldSums(voxel, near, capped);
  EXPECT_EQ(voxel.weight, 3.0f);
  EXPECT_NEAR(voxel.sdf, 0.5f * kTruncation, 1e-3);
}

}  // namespace
}  // namespace dtsdf
