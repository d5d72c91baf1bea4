#include "kernels/colour/paint.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace paint_test {

const ColourRules kRules;
const PaintSettings kAdaptive = {1, 0, 1e30f, 1.0f, ColourRules()};

VoxelColour painted(VoxelColour colour, const ColourSample& sample, int times) {
  for (int i = 0; i < times; ++i) colour = paintedColour(colour, sample, sameExposure(), kRules);
  return colour;
}

TEST(PaintedColour, FirstSampleIsTakenUnchanged) {
  const VoxelColour colour = painted({0, 0, 0, 0}, {10, 200, 255, 0.01f}, 1);
  EXPECT_EQ(colour.red, 10);
  EXPECT_EQ(colour.green, 200);
  EXPECT_EQ(colour.blue, 255);
  EXPECT_NEAR(colourWeight(colour.weight), 0.01f, 0.0005f);
}

TEST(PaintedColour, AdaptsToNewSamples) {
  VoxelColour colour = painted({0, 0, 0, 0}, {200, 0, 0, 0.5f}, 1000);
  EXPECT_NEAR(colourWeight(colour.weight), 0.5f * kRules.max_views, 0.2f);
  colour = painted(colour, {0, 0, 0, 0.5f}, 60);
  EXPECT_LT(colour.red, 10);  // changes below half a grey level are lost in rounding
}

TEST(PaintedColour, BetterViewsReplaceManyBadOnes) {
  VoxelColour colour = painted({0, 0, 0, 0}, {200, 0, 0, 0.002f}, 1000);
  colour = painted(colour, {100, 0, 0, 0.5f}, 1);
  EXPECT_NEAR(colour.red, 103, 1);
  const VoxelColour after = painted(colour, {200, 0, 0, 0.002f}, 100);
  EXPECT_LT(after.red, 125);
  EXPECT_EQ(after.weight, colour.weight);  // worse samples add no weight
}

TEST(PaintedColour, SamplesAreCorrectedForExposure) {
  const Exposure exposure{{2.0f, 0.5f, 10.0f}};
  const VoxelColour colour = paintedColour({0, 0, 0, 0}, {50, 100, 100, 1.0f}, exposure, kRules);
  EXPECT_EQ(colour.red, 100);
  EXPECT_EQ(colour.green, 50);
  EXPECT_EQ(colour.blue, 255);
}

TEST(Exposure, IsTheRatioOfMapToImage) {
  ExposureSums sums = {};
  for (int i = 0; i < 300; ++i) addToSums(sums, {100, 60, 30, 9}, {50, 60, 60, 0});
  const Exposure exposure = exposureOf(sums, {{7.0f, 7.0f, 7.0f}}, kAdaptive);
  EXPECT_EQ(exposure.gain[0], 2.0f);
  EXPECT_EQ(exposure.gain[1], 1.0f);
  EXPECT_EQ(exposure.gain[2], 0.5f);
  sums.voxels = kRules.min_overlap - 1;
  EXPECT_EQ(exposureOf(sums, {{7.0f, 7.0f, 7.0f}}, kAdaptive).gain[0], 7.0f);
}

TEST(Exposure, IsOneIfFixed) {
  ExposureSums sums = {};
  for (int i = 0; i < 300; ++i) addToSums(sums, {100, 60, 30, 9}, {50, 60, 60, 0});
  PaintSettings fixed = kAdaptive;
  fixed.fixed_exposure = 1;
  for (const int64_t voxels : {int64_t{0}, sums.voxels}) {
    sums.voxels = voxels;
    const Exposure exposure = exposureOf(sums, {{7.0f, 7.0f, 7.0f}}, fixed);
    for (const float gain : exposure.gain) EXPECT_EQ(gain, 1.0f);
  }
}

/// The map has grey level 100. The image has `factor` times that level, plus or minus `spread` in
/// alternate pixels.
TEST(Exposure, DifferencesWithinTheSpreadAreIgnored) {
  const auto gain = [](double factor, int spread) {
    ExposureSums sums = {};
    for (int i = 0; i < 300; ++i) {
      const auto value = static_cast<uint8_t>(factor * 100.0 + (i % 2 == 0 ? spread : -spread));
      addToSums(sums, {100, 100, 100, 9}, {value, value, value, 0});
    }
    return exposureOf(sums, {{7.0f, 7.0f, 7.0f}}, kAdaptive).gain[0];
  };
  EXPECT_EQ(gain(1.0, 0), 1.0f);
  EXPECT_NEAR(gain(1.05, 20), 1.0, 0.001);
  EXPECT_NEAR(gain(0.95, 20), 1.0, 0.001);
  EXPECT_NEAR(gain(0.5, 5), 2.0, 0.02);
  EXPECT_NEAR(gain(0.5, 10), 2.0, 0.1);
}

TEST(Exposure, ClippedValuesDoNotCount) {
  const uint8_t weight = colourWeightCode(1.0f);
  const auto isUsable = [](const VoxelColour& map, const VoxelColour& image) {
    return isUsableForExposure(map, image, 1.0f, kRules);
  };
  EXPECT_TRUE(isUsable({100, 100, 100, weight}, {100, 100, 100, 0}));
  EXPECT_FALSE(isUsable({100, 100, 100, 0}, {100, 100, 100, 0}));
  EXPECT_FALSE(isUsable({100, 100, 255, weight}, {100, 100, 100, 0}));
  EXPECT_FALSE(isUsable({100, 100, 100, weight}, {0, 100, 100, 0}));
}

TEST(Exposure, DissimilarWeightsDoNotCount) {
  const VoxelColour map{100, 100, 100, colourWeightCode(1.0f)}, image{100, 100, 100, 0};
  EXPECT_FALSE(isUsableForExposure(map, image, 0.05f, kRules));
  EXPECT_TRUE(isUsableForExposure(map, image, 0.125f, kRules));
  EXPECT_FALSE(isUsableForExposure(map, image, 3.0f, kRules));
}

}  // namespace paint_test
}  // namespace dtsdf
