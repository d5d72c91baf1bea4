// What is skipped without a look at its voxels, against a look at each.
#include "kernels/fusion/free_patches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "kernels/fusion/free_space.h"
#include "support/most_free.h"
#include "support/random_vectors.h"

namespace dtsdf {
namespace free_patches_test {

constexpr float kVoxel_m = 0.02f, kTruncation = 4.0f;

/// A camera that looks anywhere, at walls of its own depth for each patch of 16 x 16 pixels.
class WallImage {
 public:
  WallImage(std::mt19937& random, int width, int height) {
    std::uniform_real_distribution<float> depth_m(0.4f, 3.0f), shift(-5.0f, 5.0f);
    sensing_ = {};
    const Vec3f z = randomUnit(random);
    const Vec3f beside = fabsf(z.x) < 0.5f ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0};
    const Vec3f across = cross(beside, z), x = 1.0f / norm(across) * across, y = cross(z, x);
    sensing_.image.frame = {width,
                            height,
                            {90.0f, 95.0f, 0.5f * width, 0.4f * height},
                            {{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z},
                             {shift(random), shift(random), shift(random)}},
                            {0, 0, 0},
                            kVoxel_m};
    free_depth_.resize(static_cast<size_t>(width) * height);
    std::vector<float> walls(1024);
    for (float& wall : walls) wall = random() % 8 == 0 ? 0.0f : depth_m(random);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        free_depth_[static_cast<size_t>(v) * width + u] = walls[v / 16 * 32 + u / 16];
      }
    }
    most_free_ = mostFreeOf(sensing_.image.frame, free_depth_);
    sensing_.free_depth = free_depth_.data();
    sensing_.most_free = most_free_.data();
  }

  const FrameSensing& sensing() const { return sensing_; }

  bool seesThrough(const Vec3f& p_L) const {
    const FrameView& frame = sensing_.image.frame;
    const VoxelInImage at = projectToImage(frame, p_L);
    if (!isInImage(frame, at)) return false;
    const Pixel pixel{static_cast<int>(at.u), static_cast<int>(at.v)};
    return at.depth_m < free_depth_[pixelIndex(frame, pixel)];
  }

 private:
  FrameSensing sensing_;
  std::vector<float> free_depth_, most_free_;
};

/// A block anywhere around the camera, mostly before it.
Vec3f randomBlock(std::mt19937& random, const FrameView& frame) {
  std::uniform_real_distribution<float> along(-20.0f, 200.0f), side(-0.9f, 0.9f);
  const float z = along(random);
  const Vec3f p_C{side(random) * z, side(random) * z, z};
  return transform(frame.T_L_C, p_C);
}

/// What is passed over is nowhere seen through; and most of what is hidden is passed over.
TEST(FreePatches, PassOverWhatIsNowhereSeenThrough) {
  std::mt19937 random(5);
  int blocks_hidden = 0, blocks_passed = 0;
  std::uniform_real_distribution<float> around(-kTruncation, 7.0f + kTruncation);
  for (int round = 0; round < 2000; ++round) {
    const WallImage image(random, 17 + random() % 400, 17 + random() % 300);
    const Vec3f first_L = randomBlock(random, image.sensing().image.frame);
    bool block_through = false;
    for (int i = 0; i < 500; ++i) {
      const Vec3f foot{around(random), around(random), around(random)};
      block_through = block_through || image.seesThrough(first_L + foot);
    }
    const bool block_seen = maySeeThroughBlock(image.sensing(), first_L, kTruncation);
    EXPECT_TRUE(block_seen || !block_through) << round;
    blocks_hidden += !block_through;
    blocks_passed += !block_seen;
  }
  EXPECT_GT(blocks_hidden, 500);
  EXPECT_GT(blocks_passed, 0.8 * blocks_hidden);
}

}  // namespace free_patches_test
}  // namespace dtsdf
