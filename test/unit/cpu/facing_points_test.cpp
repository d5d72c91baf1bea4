// What a colour image sees of a block, several points at once, against point after point.
#include "cpu/facing_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "cpu/hiding_rows.h"
#include "support/surface_image.h"

namespace dtsdf {
namespace {

constexpr int kBallWidth = 161, kBallHeight = 119;
constexpr ColourRules kBallRules;
constexpr Vec3f kBallFirst_L{-3.0f, -2.0f, 0.0f};

/// A bumpy ball that reaches over the image's rim, in an image of noise.
class BumpyBall : public testing::TestWithParam<float> {
 protected:
  BumpyBall() {
    FrameView frame = frontalFrame(kBallWidth, kBallHeight, {150.0f, 140.0f, 80.0f, 60.0f}, 0.01f);
    frame.T_L_C = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.0f, 0.0f, -GetParam()}};
    sensing_.view = {frame, 1, 1, kBallRules, 10.0f, 1.0f};
    const ColourImage layout = layOut(nullptr, kBallWidth, kBallHeight);
    for (int64_t i = 0; i < pixelCount(layout); ++i) {
      pixels_.push_back({byte(), byte(), byte(), 0});
    }
    sensing_.image = layOut(pixels_.data(), kBallWidth, kBallHeight);
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      const Vec3f p = toFloat(voxelOffset(i)) - Vec3f{3.2f, 3.6f, 7.0f};
      const float distance = norm(p) - 4.0f + 0.2f * normal_(random_);
      if (normal_(random_) < 1.5f) voxels_[i] = makeVoxel(distance, 1000, 9);
    }
  }

  uint8_t byte() { return static_cast<uint8_t>(random_() & 255); }

  bool findPoint(int voxel, int direction, SurfacePoint& point) const {
    const PointView& view = sensing_.view;
    return isNearSurface(view, voxels_[voxel], kBallRules.surface_distance) &&
           findSurfacePoint(view, kBallFirst_L, voxels_, voxel, direction, point);
  }

  /// Calls visit(points) for those of a direction, in batches.
  template <class Visit>
  void visitBatches(int direction, const Visit& visit) const {
    VoxelList near;
    listNearSurface(sensing_.view, voxels_, kBallRules.surface_distance, near);
    for (int first = 0; first < near.count; first += SurfacePoints::kMost) {
      SurfacePoints points;
      points.find(sensing_.view, kBallFirst_L, voxels_, direction, near.index + first,
                  std::min(SurfacePoints::kMost, near.count - first));
      visit(points);
    }
  }

  std::mt19937 random_{5};
  std::normal_distribution<float> normal_;
  std::vector<ColourPixel> pixels_;
  Voxel voxels_[kVoxelsPerBlock] = {};
  ColourSensing sensing_ = {};
};

TEST_P(BumpyBall, IsDrawnAndSampledAsPointAfterPoint) {
  const int32_t width = cellsFor(kBallWidth), height = cellsFor(kBallHeight);
  std::vector<float> expected_m(static_cast<size_t>(width) * height, kNoSurface_m), depth_m;
  const HidingRows hiding(depth_m, width, height);
  for (int d = 0; d < kDirectionCount; ++d) {
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      SurfacePoint point;
      if (!findPoint(i, d, point) || !hides(sensing_.view, voxels_, i, d)) continue;
      drawSurface(sensing_.view, point, [&](int32_t cell, float cell_m) {
        expected_m[cell] = std::min(expected_m[cell], cell_m);
      });
    }
    visitBatches(d, [&](const SurfacePoints& points) {
      std::vector<int> listed;
      for (int i = 0; i < points.count(); ++i) {
        if (hides(sensing_.view, voxels_, points.index(i), d)) listed.push_back(i);
      }
      hiding.draw(sensing_.view, points, listed.data(), static_cast<int>(listed.size()));
    });
  }
  depth_m.resize(expected_m.size());
  EXPECT_GT(std::count(expected_m.begin(), expected_m.end(), kNoSurface_m), 100);
  EXPECT_EQ(depth_m, expected_m);

  sensing_.hiding = {expected_m.data(), width, height};
  FacingPoints facing;
  for (int round = 0; round < 2; ++round) {  // the second one finds what the first one left
    facing.clear();
    for (int d = 0; d < kDirectionCount; ++d) {
      visitBatches(d, [&](const SurfacePoints& points) { facing.add(points, d); });
    }
  }
  VoxelSamples samples;
  facing.sample(sensing_, samples);
  std::map<int, ColourSample> sampled;
  for (const VoxelSample& sample : samples) sampled[sample.voxel] = sample.sample;
  EXPECT_EQ(sampled.size(), samples.count());
  std::map<float, int> shares;
  for (int n = 0; n < kDirectionCount * kVoxelsPerBlock; ++n) {
    const int d = n / kVoxelsPerBlock, i = n % kVoxelsPerBlock;
    const ColourSample one = sampleColour(sensing_, kBallFirst_L, voxels_, i, d);
    const auto place = sampled.find(n);
    ASSERT_EQ(place != sampled.end(), one.weight > 0.0f) << n;
    SurfacePoint point;
    if (findPoint(i, d, point) && point.cosine > 0.0f) {
      ++shares[visibilityOf(sensing_.view, sensing_.hiding, point)];
    }
    if (place == sampled.end()) continue;
    EXPECT_EQ(place->second.red, one.red);
    EXPECT_EQ(place->second.green, one.green);
    EXPECT_EQ(place->second.blue, one.blue);
    EXPECT_EQ(place->second.weight, one.weight);
  }
  EXPECT_GT(samples.count(), 40u);
  EXPECT_GE(shares.size(), 2u);
}

INSTANTIATE_TEST_SUITE_P(DistanceInVoxels, BumpyBall, testing::Values(9.0f, 30.0f, 150.0f));

}  // namespace
}  // namespace dtsdf
