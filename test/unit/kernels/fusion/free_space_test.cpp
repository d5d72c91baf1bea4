// Which voxels count as seen free, and what that does to them, on analytic planes and steps.
#include "kernels/fusion/free_space.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/surface_image.h"

namespace dtsdf {
namespace {

constexpr int kWidth = 64, kHeight = 48;
constexpr Intrinsics kIntrinsics{100.0f, 100.0f, 31.5f, 23.5f};
constexpr float kVoxel_m = 0.02f, kTruncation = 4.0f;
const SurfelSettings kSurfels{5, 0.1f, SurfelRules(), 0};
const FusionSettings kFusion{1, 1, kTruncation, 1e6f, FusionRules()};

class FreeSpaceImage {
 public:
  explicit FreeSpaceImage(const Surface& surface, float sigma = 0.0f)
      : image_(surface, frontalFrame(kWidth, kHeight, kIntrinsics, kVoxel_m), kSurfels, sigma) {
    for (int i = 0; i < kWidth * kHeight; ++i) {
      const Pixel pixel{i % kWidth, i / kWidth};
      free_depth_.push_back(freeDepth(image_.sensing(), pixel, kFusion));
    }
  }

  float freeDepthAt(int u, int v) const { return free_depth_[v * kWidth + u]; }
  float weightAt(const Vec3i& voxel) const {
    FrameSensing sensing = image_.sensing();
    sensing.free_depth = free_depth_.data();
    return freeSpaceWeight(sensing, projectToImage(sensing.image.frame, voxel), kSurfels.rules,
                           kFusion.rules);
  }

 private:
  SurfaceImage image_;
  std::vector<float> free_depth_;
};

/// The point of a pixel's ray from which on nothing is free is as far from the plane as samples
/// reach, whatever the plane's tilt.
TEST(FreeDepth, EndsAtTheReachOfSamples) {
  for (const auto& n : {Vec3f{0, 0, 1}, Vec3f{0.6f, 0, 0.8f}, Vec3f{0, -0.8f, 0.6f},
                        Vec3f{0.48f, 0.64f, 0.6f}}) {
    const double delta = 1.2;
    const FreeSpaceImage image(plane(n.x, n.y, n.z, delta));
    for (int v = 8; v < kHeight - 8; ++v) {
      for (int u = 8; u < kWidth - 8; ++u) {
        const float depth_m = image.freeDepthAt(u, v);
        if (!(depth_m > 0.0f)) continue;
        const Vec3f p = backProject(kIntrinsics, static_cast<float>(u), static_cast<float>(v),
                                    depth_m);
        EXPECT_NEAR((delta - dot(n, p)) / kVoxel_m, kFusion.rules.sample_reach, 0.02)
            << u << ", " << v;
      }
    }
    EXPECT_GT(image.freeDepthAt(kWidth / 2, kHeight / 2), 0.0f);
  }
}

TEST(FreeDepth, KeepsAwayFromNoise) {
  const float noise = 0.005f, depth_m = 2.0f;
  const FreeSpaceImage image(plane(0, 0, 1, depth_m), noise);
  const float noise_m = noise * depth_m * depth_m;
  EXPECT_NEAR(depth_m - image.freeDepthAt(30, 20),
              (kFusion.rules.noise_reach + kFusion.rules.free_noise) * noise_m, 1e-3);
}

/// A wall at 2 m with the camera at the origin: voxels up to its band are free, in the band and
/// behind they are not, nor what the image does not show.
TEST(FreeSpaceWeight, EndsBeforeTheBand) {
  const FreeSpaceImage image(plane(0, 0, 1, 2.0));
  EXPECT_GT(image.weightAt({0, 0, 50}), 0.0f);
  EXPECT_GT(image.weightAt({5, -5, 98}), 0.0f);
  EXPECT_EQ(image.weightAt({5, -5, 99}), 0.0f);
  EXPECT_EQ(image.weightAt({0, 0, 110}), 0.0f);
  EXPECT_EQ(image.weightAt({60, 0, 98}), 0.0f);
  EXPECT_EQ(image.weightAt({0, 0, 0}), 0.0f);
  EXPECT_EQ(image.weightAt({0, 0, -50}), 0.0f);
}

/// A box in front of a wall: beside it the wall tells what is free, but not within a pixel of its
/// outline, which may be off by that much.
TEST(FreeSpaceWeight, StartsAPixelBesideAnOutline) {
  const FreeSpaceImage image([](double x, double) { return x < 0.0 ? 1.0 : 2.0; });
  const auto seenFree = [&](double u) {
    const double x = (u - kIntrinsics.cx) / kIntrinsics.fx;  // at 1 m, which is 50 voxels
    return image.weightAt({static_cast<int32_t>(std::lround(x / kVoxel_m)), 0, 50}) > 0.0f;
  };
  EXPECT_FALSE(seenFree(29.5));
  EXPECT_FALSE(seenFree(31.5));
  EXPECT_TRUE(seenFree(33.5));
  EXPECT_TRUE(seenFree(39.5));
}

/// A tenth of the pixels that cover the voxel, by their weight at its depth: at 1 m, (100 px / m
/// times 0.02 m)^2 = 4 pixels of weight 1. Near the camera it does not grow without bound.
TEST(FreeSpaceWeight, CountsThePixelsOfTheVoxel) {
  const FreeSpaceImage image(plane(0, 0, 1, 3.0));
  EXPECT_NEAR(image.weightAt({0, 0, 50}), 0.4f, 1e-5f);
  EXPECT_NEAR(image.weightAt({0, 0, 100}), 0.4f / 16.0f, 1e-5f);
  EXPECT_NEAR(image.weightAt({0, 0, 25}), 1.6f, 1e-5f);
  EXPECT_NEAR(image.weightAt({0, 0, 1}), 1.6f, 1e-5f);
}

TEST(FreeSpaceWeight, NeedsMeasurementsAllAround) {
  const FreeSpaceImage image([](double x, double y) {
    return std::abs(x) < 0.006 && std::abs(y) < 0.006 ? 0.0 : 2.0;  // 2 x 2 pixels
  });
  EXPECT_EQ(image.weightAt({0, 0, 50}), 0.0f);
  EXPECT_GT(image.weightAt({4, 0, 50}), 0.0f);
}

TEST(ClearedVoxel, LosesWeightBehindASurfaceOnly) {
  const Voxel in_front = clearedVoxel({0.25f, 3.0f}, 1.0f, kFusion.rules);
  EXPECT_EQ(in_front.weight, 3.0f);
  EXPECT_EQ(in_front.sdf, 0.25f);
  const Voxel behind = clearedVoxel({-0.5f, 3.0f}, 1.0f, kFusion.rules);
  EXPECT_EQ(behind.weight, 2.0f);
  EXPECT_EQ(behind.sdf, -0.5f);
}

/// What has no weight left, or never had any, gets a negative weight that does not grow without
/// end.
TEST(ClearedVoxel, FallsBelowZeroByALimit) {
  EXPECT_LT(clearedVoxel({-0.5f, 1.0f}, 1.0f, kFusion.rules).weight, 0.0f);
  Voxel voxel{0.0f, 0.0f};
  for (int frame = 0; frame < 100; ++frame) voxel = clearedVoxel(voxel, 0.5f, kFusion.rules);
  EXPECT_EQ(voxel.weight, -kFusion.rules.most_free_frames * 0.5f);
  // A frame that says less of it takes nothing back.
  EXPECT_EQ(clearedVoxel(voxel, 0.01f, kFusion.rules).weight, voxel.weight);
}

VoxelSums sumsOf(float sdf_voxels, float weight) {
  VoxelSums sums{0, 0};
  addToSums(sums, quantiseWeight(weight), quantiseSdf(sdf_voxels / kTruncation));
  return sums;
}

/// Samples behind a surface make up for a negative weight first; one in front agrees with the free
/// space.
TEST(FoldSums, MakesUpForFreeSpaceWithSamplesBehind) {
  const Voxel free{0.0f, -1.0f};
  const Voxel less = foldSums(free, sumsOf(-0.5f, 0.75f), kFusion);
  EXPECT_FLOAT_EQ(less.weight, -0.25f);
  const Voxel more = foldSums(less, sumsOf(-0.5f, 0.75f), kFusion);
  EXPECT_FLOAT_EQ(more.weight, 0.5f);
  EXPECT_NEAR(more.sdf, -0.5f, 1e-3f);
  const Voxel even = foldSums(free, sumsOf(-0.5f, 1.0f), kFusion);
  EXPECT_LT(even.weight, 0.0f);  // 0 would mean that nothing was ever there
  const Voxel in_front = foldSums(free, sumsOf(0.5f, 0.75f), kFusion);
  EXPECT_FLOAT_EQ(in_front.weight, 0.75f);
  EXPECT_NEAR(in_front.sdf, 0.5f, 1e-3f);
}

}  // namespace
}  // namespace dtsdf
