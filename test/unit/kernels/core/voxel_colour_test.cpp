#include "kernels/core/voxel_colour.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dtsdf {
namespace voxel_colour_test {

TEST(VoxelColour, WeightCodesAreAccurate) {
  for (float weight = 0.0005f; weight < 15.0f; weight *= 1.01f) {
    EXPECT_NEAR(colourWeight(colourWeightCode(weight)) / weight, 1.0, 1.0 / 32.0) << weight;
  }
}

TEST(VoxelColour, TinyWeightsDoNotBecomeZero) {
  EXPECT_EQ(colourWeightCode(1e-9f), 1);
  EXPECT_EQ(colourWeightCode(std::ldexp(1.0f, -12)), 1);
  EXPECT_EQ(colourWeightCode(100.0f), 255);
}

}  // namespace voxel_colour_test
}  // namespace dtsdf
