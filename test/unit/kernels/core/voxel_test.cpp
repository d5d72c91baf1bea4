#include "kernels/core/voxel.h"

#include <gtest/gtest.h>

#include <limits>

namespace dtsdf {
namespace voxel_test {

/// Weight and evidence share one word without overflowing into each other.
TEST(Voxel, HoldsDistanceWeightAndEvidence) {
  for (const uint32_t units : {0u, 1u, 98304u, (1u << 24) - 1u}) {
    for (const int32_t evidence : {-127, -1, 0, 1, 24, 127}) {
      const Voxel voxel = makeVoxel(-1.25f, units, evidence);
      EXPECT_EQ(sdfOf(voxel), -1.25f);
      EXPECT_EQ(weightUnits(voxel), units);
      EXPECT_EQ(evidenceOf(voxel), evidence);
      EXPECT_EQ(isEmpty(voxel), units == 0);
    }
  }
  EXPECT_EQ(weightOf(makeVoxel(0.0f, 98304, 7)), 1.5f);
  EXPECT_EQ(sizeof(Voxel), 8u);
}

/// Meshing treats a voxel with too little evidence as not measured.
TEST(Voxel, IsKnownWithEnoughEvidence) {
  const Voxel voxel = makeVoxel(-1.25f, 98304, 4);
  EXPECT_EQ(sampleOf(voxel, 4).sdf, -1.25f);
  EXPECT_EQ(sampleOf(voxel, 4).weight, 1.5f);
  EXPECT_EQ(sampleOf(voxel, 5).weight, 0.0f);
  EXPECT_EQ(sampleOf(makeVoxel(0.0f, 0, 0), 1).weight, 0.0f);
}

TEST(VoxelSums, QuantisedDistancesAreClamped) {
  EXPECT_EQ(quantiseWeight(0.0f), 0);
  EXPECT_EQ(quantiseWeight(1.0f), 1 << 20);
  for (const float beyond : {1.0f, 1.5f, 1e30f, std::numeric_limits<float>::infinity()}) {
    EXPECT_EQ(quantiseSdf(beyond), 1 << 15);
    EXPECT_EQ(quantiseSdf(-beyond), -(1 << 15));
  }
}

/// The worst case for one voxel: every pixel of the largest image adds the maximum distance, with
/// twice the maximum weight. Even a subdivided pixel adds less.
TEST(VoxelSums, WorstCaseDoesNotOverflow) {
  const int64_t weight = 2 * quantiseWeight(1.0f), sdf = quantiseSdf(1.0f);
  const int64_t limit = std::numeric_limits<int64_t>::max();
  EXPECT_LT(weight * sdf, limit / kMaxPixels);
  VoxelSums sums{weight * sdf * (kMaxPixels - 1), weight * (kMaxPixels - 1), 0, 0};
  addToSums(sums, static_cast<int32_t>(weight), static_cast<int32_t>(sdf), 0);
  EXPECT_EQ(sums.weight, weight * kMaxPixels);
  EXPECT_EQ(sums.weighted_sdf, weight * sdf * kMaxPixels);
}

}  // namespace voxel_test
}  // namespace dtsdf
