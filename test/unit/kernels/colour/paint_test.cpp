#include "kernels/colour/paint.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "simulation/random.h"
#include "support/surface_image.h"

namespace dtsdf {
namespace paint_test {

const ColourRules kRules;
const PaintSettings kAdaptive = {1, 0, 1e30f, 1.0f, ColourRules()};

VoxelColour painted(VoxelColour colour, const ColourSample& sample, int times) {
  for (int i = 0; i < times; ++i) colour = paintedColour(colour, sample, sameExposure(), kRules);
  return colour;
}

TEST(PaintedColour, FirstIsTakenAsItIs) {
  const VoxelColour colour = painted({0, 0, 0, 0}, {10, 200, 255, 0.01f}, 1);
  EXPECT_EQ(colour.red, 10);
  EXPECT_EQ(colour.green, 200);
  EXPECT_EQ(colour.blue, 255);
  EXPECT_NEAR(colourWeight(colour.weight), 0.01f, 0.0005f);
}

TEST(PaintedColour, FollowsWhatItSees) {
  VoxelColour colour = painted({0, 0, 0, 0}, {200, 0, 0, 0.5f}, 1000);
  EXPECT_NEAR(colourWeight(colour.weight), 0.5f * kRules.most_views, 0.2f);
  colour = painted(colour, {0, 0, 0, 0.5f}, 60);
  EXPECT_LT(colour.red, 10);  // a step of less than half a level is none
}

TEST(PaintedColour, BetterViewsReplaceManyBadOnes) {
  VoxelColour colour = painted({0, 0, 0, 0}, {200, 0, 0, 0.002f}, 1000);
  colour = painted(colour, {100, 0, 0, 0.5f}, 1);
  EXPECT_NEAR(colour.red, 103, 1);
  const VoxelColour after = painted(colour, {200, 0, 0, 0.002f}, 100);
  EXPECT_LT(after.red, 125);
  EXPECT_EQ(after.weight, colour.weight);  // bad ones do not add up to a good one
}

TEST(PaintedColour, ExposureComesFirst) {
  const Exposure exposure{{2.0f, 0.5f, 10.0f}};
  const VoxelColour colour = paintedColour({0, 0, 0, 0}, {50, 100, 100, 1.0f}, exposure, kRules);
  EXPECT_EQ(colour.red, 100);
  EXPECT_EQ(colour.green, 50);
  EXPECT_EQ(colour.blue, 255);
}

TEST(Exposure, IsTheRatioOfWhatBothShow) {
  ExposureSums sums = {};
  for (int i = 0; i < 300; ++i) addToSums(sums, {100, 60, 30, 9}, {50, 60, 60, 0});
  const Exposure exposure = exposureOf(sums, {{7.0f, 7.0f, 7.0f}}, kAdaptive);
  EXPECT_EQ(exposure.gain[0], 2.0f);
  EXPECT_EQ(exposure.gain[1], 1.0f);
  EXPECT_EQ(exposure.gain[2], 0.5f);
  sums.voxels = kRules.least_overlap - 1;
  EXPECT_EQ(exposureOf(sums, {{7.0f, 7.0f, 7.0f}}, kAdaptive).gain[0], 7.0f);
}

TEST(Exposure, IsOneWhereCamerasHaveItFixed) {
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

/// Voxels of 100 that an image shows brighter and darker by turns, and on average by a factor.
TEST(Exposure, DifferencesForOtherReasonsAreNone) {
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

TEST(Exposure, WhatIsCutOffDoesNotTell) {
  const uint8_t weight = colourWeightCode(1.0f);
  const auto tells = [](const VoxelColour& map, const VoxelColour& image) {
    return tellsExposure(map, image, 1.0f, kRules);
  };
  EXPECT_TRUE(tells({100, 100, 100, weight}, {100, 100, 100, 0}));
  EXPECT_FALSE(tells({100, 100, 100, 0}, {100, 100, 100, 0}));
  EXPECT_FALSE(tells({100, 100, 255, weight}, {100, 100, 100, 0}));
  EXPECT_FALSE(tells({100, 100, 100, weight}, {0, 100, 100, 0}));
}

TEST(Exposure, WhatIsSeenMuchBetterOrWorseDoesNotTell) {
  const VoxelColour map{100, 100, 100, colourWeightCode(1.0f)}, image{100, 100, 100, 0};
  EXPECT_FALSE(tellsExposure(map, image, 0.05f, kRules));
  EXPECT_TRUE(tellsExposure(map, image, 0.125f, kRules));
  EXPECT_FALSE(tellsExposure(map, image, 3.0f, kRules));
}

/// A camera that looks along z at the voxels of one block, 64 voxels off.
class SeenSurface : public testing::Test {
 protected:
  static constexpr float kVoxel_m = 0.01f, kDepth_voxels = 64.0f;

  SeenSurface() {
    sensing_.view = {frontalFrame(160, 120, {150.0f, 150.0f, 80.0f, 60.0f}, kVoxel_m),
                     1,
                     1,
                     kRules,
                     kAdaptive.max_depth_m,
                     kAdaptive.full_weight_depth_m};
    sensing_.image = layOut(pixels_.data(), 160, 120);
    sensing_.hiding = {hiding_m_.data(), cellsFor(160), cellsFor(120)};
  }

  /// A plane across z that faces the camera, `offset` voxels behind the block's first layer.
  void makePlane(float offset) {
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      const auto z = static_cast<float>(voxelOffset(i).z);
      voxels_[i] = makeVoxel(offset - z, 1000, 9);
    }
  }

  static size_t cellAt(float u_px, float v_px) {
    return static_cast<size_t>(cellOf(v_px, cellsFor(120)) * cellsFor(160) +
                               cellOf(u_px, cellsFor(160)));
  }

  ColourSample sample(int index, int direction = kTowardsCamera) const {
    return sampleColour(sensing_, {0.0f, 0.0f, kDepth_voxels}, voxels_, index, direction);
  }

  static constexpr int kTowardsCamera = 5;  // Z-
  Voxel voxels_[kVoxelsPerBlock] = {};
  std::vector<ColourPixel> pixels_ = std::vector<ColourPixel>(
      static_cast<size_t>(pixelCount(layOut(nullptr, 160, 120))), ColourPixel{10, 20, 30, 0});
  std::vector<float> hiding_m_ =
      std::vector<float>(static_cast<size_t>(cellsFor(160) * cellsFor(120)), kNoSurface_m);
  ColourSensing sensing_ = {};
};

TEST_F(SeenSurface, IsPaintedWhereItIsNear) {
  makePlane(3.3f);
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    const int z = voxelOffset(i).z;
    EXPECT_EQ(sample(i).weight > 0.0f, z == 3) << z;  // 0.3 voxels off, the next one 0.7
  }
  EXPECT_EQ(sample(voxelIndex(4, 4, 3)).green, 20);
}

TEST_F(SeenSurface, NotFromBehindNorInAnotherDirection) {
  makePlane(3.3f);
  const int index = voxelIndex(4, 4, 3);
  EXPECT_GT(sample(index).weight, 0.0f);
  EXPECT_EQ(sample(index, 0).weight, 0.0f);
  for (Voxel& voxel : voxels_) voxel.sdf_units = static_cast<int16_t>(-voxel.sdf_units);
  EXPECT_EQ(sample(index, 4).weight, 0.0f);  // Z+ faces away
}

TEST_F(SeenSurface, NotBehindAnother) {
  makePlane(3.3f);
  const int index = voxelIndex(4, 4, 3);
  const float own_m = (kDepth_voxels + 3.3f) * kVoxel_m;
  const float limit_m = kRules.hidden_depth * kVoxel_m;
  for (const float share : {0.3f, 0.98f, 1.02f, 20.0f}) {
    hiding_m_.assign(hiding_m_.size(), own_m - share * limit_m);
    EXPECT_EQ(sample(index).weight > 0.0f, share < 1.0f) << share;
  }
}

TEST_F(SeenSurface, BesideSomethingNearer) {
  makePlane(3.3f);
  const int index = voxelIndex(4, 4, 3);
  const float own_m = (kDepth_voxels + 3.3f) * kVoxel_m;
  hiding_m_.assign(hiding_m_.size(), 0.5f * own_m);
  EXPECT_EQ(sample(index).weight, 0.0f);
  hiding_m_[cellAt(89.4f, 69.4f)] = own_m;  // the one that it is seen in
  EXPECT_GT(sample(index).weight, 0.0f);
}

/// What is passed over as facing away is never seen; and much is passed over.
TEST_F(SeenSurface, HidesWhereBothSidesAreKnown) {
  makePlane(3.3f);
  const int front = voxelIndex(4, 4, 3), behind = voxelIndex(4, 4, 4);
  EXPECT_TRUE(hides(sensing_.view, voxels_, front, kTowardsCamera));
  EXPECT_FALSE(hides(sensing_.view, voxels_, behind, kTowardsCamera));  // 0.7 voxels off
  voxels_[behind] = makeVoxel(0.0f, 0, 0);
  EXPECT_FALSE(hides(sensing_.view, voxels_, front, kTowardsCamera));
  voxels_[behind] = makeVoxel(0.2f, 1000, 9);  // no surface in between
  EXPECT_FALSE(hides(sensing_.view, voxels_, front, kTowardsCamera));
  makePlane(7.3f);  // the next one is in another block
  EXPECT_TRUE(hides(sensing_.view, voxels_, voxelIndex(4, 4, 7), kTowardsCamera));
}

/// Two surfaces that meet do not hide each other: what is seen beside the point is nearer than its
/// plane there, but not than the point.
TEST_F(SeenSurface, ConcaveEdgesAreSeen) {
  makePlane(3.3f);
  for (int i = 0; i < kVoxelsPerBlock; ++i) {  // a floor that rises towards the right
    const Vec3i at = voxelOffset(i);
    const float offset = 3.3f + 0.8f * static_cast<float>(at.x - 4);
    voxels_[i] = makeVoxel((offset - static_cast<float>(at.z)) / 1.281f, 1000, 9);
  }
  const float own_m = (kDepth_voxels + 3.3f) * kVoxel_m;
  hiding_m_.assign(hiding_m_.size(), own_m);
  EXPECT_GT(sample(voxelIndex(4, 4, 3)).weight, 0.0f);
}

TEST_F(SeenSurface, DrawsThePlaneWithoutGaps) {
  makePlane(3.3f);
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    SurfacePoint point;
    if (!hides(sensing_.view, voxels_, i, kTowardsCamera)) continue;
    ASSERT_TRUE(findSurfacePoint(sensing_.view, {0.0f, 0.0f, kDepth_voxels}, voxels_, i,
                                 kTowardsCamera, point));
    drawSurface(sensing_.view, point, [&](int32_t cell, float depth_m) {
      hiding_m_[cell] = std::min(hiding_m_[cell], depth_m);
    });
  }
  const float own_m = (kDepth_voxels + 3.3f) * kVoxel_m;
  // Voxels 0 to 7 are seen from pixel (80.5, 60.5) on, a voxel as wide as this:
  const float width_px = 150.0f / (kDepth_voxels + 3.3f);
  for (float v = 0.0f; v <= 7.0f; v += 0.5f) {
    for (float u = 0.0f; u <= 7.0f; u += 0.5f) {
      EXPECT_NEAR(hiding_m_[cellAt(80.5f + u * width_px, 60.5f + v * width_px)], own_m, 1e-5f);
    }
  }
  EXPECT_EQ(hiding_m_[0], kNoSurface_m);
}

/// Each point of a floor that is seen at a grazing angle is drawn where it is, and not over those
/// behind it.
TEST_F(SeenSurface, AGrazingFloorDoesNotHideItself) {
  const float slope = 0.2f;  // height over distance
  const auto pointAt = [&](float depth_m) {
    return seenPoint(sensing_.view.frame.intrinsics,
                     {0.0f, slope * kDepth_voxels * kVoxel_m, depth_m}, {0.0f, -1.0f, 0.0f});
  };
  const float first_m = 0.8f * kDepth_voxels * kVoxel_m, last_m = 1.3f * kDepth_voxels * kVoxel_m;
  for (float depth_m = first_m; depth_m < last_m; depth_m += kVoxel_m) {
    drawSurface(sensing_.view, pointAt(depth_m), [&](int32_t cell, float cell_m) {
      hiding_m_[cell] = std::min(hiding_m_[cell], cell_m);
    });
  }
  for (float depth_m = first_m; depth_m < last_m; depth_m += kVoxel_m) {
    EXPECT_FALSE(isHidden(sensing_.view, sensing_.hiding, pointAt(depth_m))) << depth_m;
  }
}

}  // namespace paint_test
}  // namespace dtsdf
