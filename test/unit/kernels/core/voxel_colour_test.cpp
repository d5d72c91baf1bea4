#include "kernels/core/voxel_colour.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dtsdf {
namespace {

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

}  // namespace
}  // namespace dtsdf
