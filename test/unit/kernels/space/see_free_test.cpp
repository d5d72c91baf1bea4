// What an image sees through, against all of its pixels.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "kernels/space/see_free.h"
#include "support/random_seed.h"

namespace dtsdf {
namespace {

/// Free depths with their pyramid.
class FreeImage {
 public:
  FreeImage(int width, int height, float depth_m)
      : width_(width), height_(height), levels_(kFreeLevels) {
    levels_[0].assign(static_cast<size_t>(width) * height, depth_m);
  }

  float& at(int u, int v) { return levels_[0][static_cast<size_t>(v) * width_ + u]; }

  FreePyramid pyramid() {
    FreePyramid free{{levels_[0].data()}, width_, height_};
    for (int k = 1; k < kFreeLevels; ++k) {
      const int width = texelsFor(width_, k), height = texelsFor(height_, k);
      levels_[k].resize(static_cast<size_t>(width) * height);
      for (int v = 0; v < height; ++v) {
        for (int u = 0; u < width; ++u) {
          levels_[k][static_cast<size_t>(v) * width + u] = leastBelow(
              levels_[k - 1].data(), texelsFor(width_, k - 1), texelsFor(height_, k - 1), u, v);
        }
      }
      free.level[k] = levels_[k].data();
    }
    return free;
  }

  /// The least of the pixels that are in part within so many of the bounds' sides.
  float leastAround(const SeenBounds& seen, float margin_px) const {
    float least = 1e9f;
    for (int v = 0; v < height_; ++v) {
      for (int u = 0; u < width_; ++u) {
        const auto left = static_cast<float>(u), top = static_cast<float>(v);
        if (left + 1.0f <= seen.left - margin_px || left > seen.right + margin_px ||
            top + 1.0f <= seen.top - margin_px || top > seen.bottom + margin_px) {
          continue;
        }
        least = std::min(least, levels_[0][static_cast<size_t>(v) * width_ + u]);
      }
    }
    return least;
  }

 private:
  int width_, height_;
  std::vector<std::vector<float>> levels_;
};

/// A body 0.1 m deep before pixels (10, 10) to (13, 12) of an image that is free up to 2 m.
constexpr SeenBounds kBody = {1.8f, 1.9f, 10.0f, 13.5f, 10.0f, 12.5f};

TEST(SeeFree, IsFreeUpToTheFarEnd) {
  FreeImage image(40, 30, 2.0f);
  const FreePyramid free = image.pyramid();
  EXPECT_TRUE(isSeenFree(free, kBody));
  SeenBounds deeper = kBody;
  deeper.far_m = 2.1f;
  EXPECT_FALSE(isSeenFree(free, deeper));
}

TEST(SeeFree, OnlyWhatIsWhollyInTheImageAndBeforeTheCamera) {
  FreeImage image(40, 30, 2.0f);
  const FreePyramid free = image.pyramid();
  for (const SeenBounds& beyond : {SeenBounds{1.8f, 1.9f, -0.5f, 3.0f, 10.0f, 12.0f},
                                   {1.8f, 1.9f, 3.0f, 40.0f, 10.0f, 12.0f},
                                   {1.8f, 1.9f, 3.0f, 5.0f, -0.1f, 12.0f},
                                   {1.8f, 1.9f, 3.0f, 5.0f, 10.0f, 30.0f},
                                   {0.0f, 1.9f, 3.0f, 5.0f, 10.0f, 12.0f},
                                   {-1.0f, 1.9f, 3.0f, 5.0f, 10.0f, 12.0f}}) {
    EXPECT_FALSE(isSeenFree(free, beyond));
  }
}

/// Whatever its size: what is called free is, in each pixel that it covers; and what is free as far
/// around as it is wide is called so.
TEST(SeeFree, AgreesWithThePixels) {
  std::mt19937 random(caseSeed(0));
  std::uniform_real_distribution<float> share(0.0f, 1.0f);
  int free_ones = 0, missed = 0;
  for (int round = 0; round < 200; ++round) {
    FreeImage image(53, 47, 2.0f);
    for (int i = 0; i < 6; ++i) {
      image.at(static_cast<int>(52.9f * share(random)), static_cast<int>(46.9f * share(random))) =
          share(random);
    }
    const float left = 50.0f * share(random), top = 44.0f * share(random);
    const SeenBounds seen{1.0f, 1.5f,
                          left, left + (52.9f - left) * share(random),
                          top,  top + (46.9f - top) * share(random)};
    const bool is_free = isSeenFree(image.pyramid(), seen);
    if (is_free) {
      ++free_ones;
      EXPECT_GT(image.leastAround(seen, 0.0f), seen.far_m);
    }
    const float width = std::max(seen.right - seen.left, seen.bottom - seen.top);
    if (!is_free && image.leastAround(seen, width + 1.0f) > seen.far_m) ++missed;
  }
  EXPECT_GT(free_ones, 40);
  EXPECT_EQ(missed, 0);
}

}  // namespace
}  // namespace dtsdf
