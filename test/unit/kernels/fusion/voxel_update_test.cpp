// Tests how a frame's sums change the mean distance, weight, evidence and anchor of a voxel.
#include "kernels/fusion/voxel_update.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace dtsdf {
namespace voxel_update_test {

constexpr float kTruncation = 4.0f, kMaxWeight = 64.0f;
constexpr uint32_t kOne = 1 << 16;  // a weight of 1, in stored units of 2^-16
const FusionSettings kFusion{1, 1, kTruncation, kMaxWeight, FusionRules()};
const Voxel kEmpty = makeVoxel(0.0f, 0, 0);

VoxelSums sumsOf(float sdf_voxels, float weight) {
  VoxelSums sums{};
  addToSums(sums, quantiseWeight(weight), quantiseSdf(sdf_voxels / kTruncation), 0);
  return sums;
}

Voxel fold(const Voxel& voxel, float sdf_voxels, float weight, float depth_weight = 1.0f) {
  return foldSums(voxel, sumsOf(sdf_voxels, weight), depth_weight, kFusion);
}

/// The worst case: kMaxPixels pixels with twice the greatest weight, at the truncation distance.
TEST(FoldSums, WorstCaseDoesNotOverflow) {
  const int64_t weight = int64_t{2} * kMaxPixels << 20;
  const Voxel voxel = foldSums(kEmpty, {weight << 15, weight, 0, 0}, 1.0f, kFusion);
  EXPECT_FLOAT_EQ(sdfOf(voxel), kTruncation);
  EXPECT_EQ(weightUnits(voxel), kOne);
}

TEST(FoldSums, UnmeasuredVoxelsAreUnchanged) {
  const Voxel before = makeVoxel(-1.25f, 54321, 6);
  const Voxel after = foldSums(before, VoxelSums{}, 1.0f, kFusion);
  EXPECT_EQ(sdfOf(after), sdfOf(before));
  EXPECT_EQ(after.state, before.state);
  EXPECT_TRUE(isEmpty(foldSums(kEmpty, VoxelSums{}, 1.0f, kFusion)));
}

/// The distance is the mean of the frames' mean distances. Each frame is weighted by its coverage
/// of the voxel, capped at 1.
TEST(FoldSums, GivesTheWeightedMean) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> distance(-1.0f, 1.0f), weight(0.01f, 0.1f);
  Voxel voxel = kEmpty;
  double sum = 0.0, sum_weight = 0.0;
  for (int frame = 0; frame < 50; ++frame) {
    VoxelSums sums{};
    double frame_sum = 0.0, covered = 0.0;
    for (int pixel = 0; pixel < 30; ++pixel) {
      const float w = weight(random), d = distance(random);
      addToSums(sums, quantiseWeight(w), quantiseSdf(d), 0);
      frame_sum += static_cast<double>(w) * d * kTruncation;
      covered += w;
    }
    voxel = foldSums(voxel, sums, 1.0f, kFusion);
    sum += std::min(covered, 1.0) * frame_sum / covered;
    sum_weight += std::min(covered, 1.0);
  }
  EXPECT_NEAR(weightOf(voxel), sum_weight, 1e-3);
  EXPECT_NEAR(sdfOf(voxel), sum / sum_weight, 1e-3);
}

/// A frame with ten pixels on a voxel adds no more weight than one whose single pixel covers it.
TEST(FoldSums, AFrameAddsAtMostWeightOne) {
  EXPECT_EQ(weightUnits(fold(kEmpty, 0.5f, 0.25f)), kOne / 4);
  EXPECT_EQ(weightUnits(fold(kEmpty, 0.5f, 1.0f)), kOne);
  EXPECT_EQ(weightUnits(fold(kEmpty, 0.5f, 10.0f)), kOne);
  EXPECT_EQ(weightUnits(fold(fold(kEmpty, 0.5f, 10.0f), 0.5f, 10.0f)), 2 * kOne);
}

/// The depth weight is applied after the cap of 1. Otherwise a distant frame that covers the voxel
/// well would count as much as a near frame.
TEST(FoldSums, DepthWeightAppliesAfterTheCap) {
  EXPECT_EQ(weightUnits(fold(kEmpty, 0.5f, 10.0f, 0.25f)), kOne / 4);
  EXPECT_EQ(weightUnits(fold(kEmpty, 0.5f, 0.5f, 0.25f)), kOne / 8);
  const Voxel mixed = fold(makeVoxel(1.0f, kOne, 3), -1.0f, 10.0f, 0.25f);
  EXPECT_NEAR(sdfOf(mixed), (1.0 - 0.25) / 1.25, 1e-4);
}

TEST(FoldSums, NewMeasurementsCountAtMaximumWeight) {
  const FusionSettings capped{1, 1, kTruncation, 3.0f, FusionRules()};
  Voxel voxel = makeVoxel(-2.0f, 3 * kOne, 24);
  voxel = foldSums(voxel, sumsOf(2.0f, 1.0f), 1.0f, capped);
  EXPECT_EQ(weightUnits(voxel), 3 * kOne);
  EXPECT_NEAR(sdfOf(voxel), (3 * -2.0 + 2.0) / 4.0, 1e-4);
  for (int i = 0; i < 40; ++i) voxel = foldSums(voxel, sumsOf(2.0f, 1.0f), 1.0f, capped);
  EXPECT_NEAR(sdfOf(voxel), 2.0f, 1e-3f);
}

/// The maximum of fusion/max_weight fits into 24 bits, next to the evidence.
TEST(FoldSums, GreatestMaximumWeightFits) {
  const FusionSettings capped{1, 1, kTruncation, 255.0f, FusionRules()};
  Voxel voxel = makeVoxel(0.5f, 255 * kOne - 1, 7);
  voxel = foldSums(voxel, sumsOf(0.5f, 1.0f), 1.0f, capped);
  EXPECT_EQ(weightUnits(voxel), 255 * kOne);
  EXPECT_EQ(evidenceOf(voxel), 10);
  EXPECT_NEAR(sdfOf(voxel), 0.5f, 1e-4f);
}

/// A voxel that a surfel hardly covers is updated, but gets no evidence of a surface.
TEST(FoldSums, LowCoverageIsAveragedWithoutSupport) {
  const float least = kFusion.rules.support_share;
  const Voxel fringe = fold(kEmpty, 0.5f, 0.9f * least);
  EXPECT_EQ(evidenceOf(fringe), 0);
  EXPECT_GT(weightUnits(fringe), 0u);
  EXPECT_NEAR(sdfOf(fringe), 0.5f, 1e-3f);
  EXPECT_EQ(evidenceOf(fold(kEmpty, 0.5f, 1.1f * least)), 3);
  const Voxel before = makeVoxel(1.0f, kOne, 6);
  EXPECT_EQ(evidenceOf(fold(before, 0.5f, 0.9f * least)), 6);
  EXPECT_EQ(evidenceOf(fold(before, 0.5f, 1.1f * least)), 9);
}

/// Samples farther than sample_reach (the largest sample distance for noise-free points) from the
/// surface, on either side, are averaged, but give no evidence of a surface.
TEST(FoldSums, FarSamplesAreAveragedWithoutSupport) {
  const float reach = kFusion.rules.sample_reach;
  for (const float side : {-1.0f, 1.0f}) {
    const Voxel far = fold(kEmpty, side * (reach + 0.01f), 1.0f);
    EXPECT_EQ(evidenceOf(far), 0);
    EXPECT_EQ(weightUnits(far), kOne);
    EXPECT_NEAR(sdfOf(far), side * reach, 0.02f);
    EXPECT_EQ(evidenceOf(fold(kEmpty, side * (reach - 0.01f), 1.0f)), 3);
    const Voxel before = makeVoxel(0.0f, kOne, 6);
    EXPECT_EQ(evidenceOf(fold(before, side * (reach + 0.01f), 1.0f)), 6);
  }
  FusionSettings projecting = kFusion;  // in voxel projection, distances are differences of depth
  projecting.support_reach = kTruncation;
  EXPECT_EQ(evidenceOf(foldSums(kEmpty, sumsOf(3.9f, 1.0f), 1.0f, projecting)), 3);
}

VoxelSums sumsWithPoint(float sdf_voxels, float weight, const Vec3f& point) {
  VoxelSums sums{};
  const uint32_t key = pointKey(point, {pointShift(0), pointShift(1), pointShift(2)}, sdf_voxels);
  addToSums(sums, quantiseWeight(weight), quantiseSdf(sdf_voxels / kTruncation), key);
  return sums;
}

Voxel foldPoint(const Voxel& voxel, float sdf_voxels, float weight, const Vec3f& point) {
  return foldSums(voxel, sumsWithPoint(sdf_voxels, weight, point), 1.0f, kFusion);
}

TEST(FoldAnchor, StartsAtTheFirstMeasuredPoint) {
  const Voxel voxel = foldPoint(kEmpty, 0.0f, 1.0f, {0.5f, -0.25f, 0.0f});
  const Vec3f offset = anchorOffset(voxel.anchor);
  EXPECT_NEAR(offset.x, 0.5f, 0.055f);
  EXPECT_NEAR(offset.y, -0.25f, 0.055f);
  EXPECT_NEAR(offset.z, 0.0f, 0.055f);
}

/// A point is weighted by its frame's weight times (1 - t)^2, where t is its distance in voxels
/// from the foot, the base of the voxel's perpendicular to the surface. Here, t is 0.1 or 0.5.
TEST(FoldAnchor, NearPointsCountMore) {
  const auto meanX = [](float first, float second, float second_weight) {
    double sum = 0.0;
    for (int i = 0; i < 400; ++i) {  // slightly different weights vary the rounding
      const float scale = 1.0f - 1e-4f * static_cast<float>(i);
      Voxel voxel = foldPoint(kEmpty, 0.0f, scale, {first, 0.0f, 0.0f});
      voxel = foldPoint(voxel, 0.0f, second_weight * scale, {second, 0.0f, 0.0f});
      sum += anchorOffset(voxel.anchor).x;
    }
    return sum / 400.0;
  };
  EXPECT_NEAR(meanX(0.5f, -0.5f, 1.0f), 0.0, 0.02);
  EXPECT_NEAR(meanX(0.5f, -0.5f, 0.25f), 0.3, 0.02);
  const double near = 0.9 * 0.9, far = 0.5 * 0.5;
  EXPECT_NEAR(meanX(0.5f, 0.1f, 1.0f), (far * 0.5 + near * 0.1) / (far + near), 0.02);
  EXPECT_NEAR(meanX(0.1f, 0.5f, 1.0f), (far * 0.5 + near * 0.1) / (far + near), 0.02);
}

TEST(DepthWeight, FallsWithTheSquareBeyondOneMetre) {
  const FusionRules rules;
  EXPECT_EQ(depthWeight(0.2f, rules), 1.0f);
  EXPECT_EQ(depthWeight(1.0f, rules), 1.0f);
  EXPECT_FLOAT_EQ(depthWeight(2.0f, rules), 0.25f);
  EXPECT_FLOAT_EQ(depthWeight(3.0f, rules), 1.0f / 9.0f);
  FusionRules farther;
  farther.full_weight_depth_m = 2.0f;
  EXPECT_FLOAT_EQ(depthWeight(4.0f, farther), 0.25f);
}

}  // namespace voxel_update_test
}  // namespace dtsdf
