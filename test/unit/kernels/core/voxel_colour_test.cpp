#include "kernels/core/voxel_colour.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace dtsdf {
namespace voxel_colour_test {

/// Each voxel has a place of its own, and neighbours within a brick share it.
TEST(Bricks, HoldEachVoxelOnce) {
  std::set<int> places;
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    const Vec3i at = voxelOffset(i);
    EXPECT_EQ(brickOf(i), at.x / 4 + 2 * (at.y / 4) + 4 * (at.z / 4));
    EXPECT_EQ(placeInBrick(i), at.x % 4 + 4 * (at.y % 4) + 16 * (at.z % 4));
    places.insert(brickOf(i) * kVoxelsPerBrick + placeInBrick(i));
    EXPECT_EQ(brickBit(3, i), uint64_t{1} << (24 + brickOf(i)));
  }
  EXPECT_EQ(places.size(), static_cast<size_t>(kVoxelsPerBlock));
}

TEST(VoxelColour, CodesRiseWithTheWeight) {
  EXPECT_EQ(colourWeight(0), 0.0f);
  for (int code = 1; code < 255; ++code) {
    const float weight = colourWeight(static_cast<uint8_t>(code));
    EXPECT_LT(weight, colourWeight(static_cast<uint8_t>(code + 1)));
    EXPECT_EQ(colourWeightCode(weight), code);
  }
  EXPECT_EQ(colourWeight(255), 15.5f);
}

TEST(VoxelColour, CodesAreTheNearest) {
  for (float weight = 0.0005f; weight < 15.0f; weight *= 1.01f) {
    EXPECT_NEAR(colourWeight(colourWeightCode(weight)) / weight, 1.0, 1.0 / 32.0) << weight;
  }
}

TEST(VoxelColour, WhatWasSeenBadlyWasSeen) {
  EXPECT_EQ(colourWeightCode(1e-9f), 1);
  EXPECT_EQ(colourWeightCode(std::ldexp(1.0f, -12)), 1);
  EXPECT_EQ(colourWeightCode(100.0f), 255);
}

}  // namespace voxel_colour_test
}  // namespace dtsdf
