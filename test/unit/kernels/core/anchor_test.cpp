// Tests how anchors (offsets of measured points) are rounded, and how the points' keys are ordered.
#include "kernels/core/anchor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace dtsdf {
namespace anchor_test {

constexpr float kToNearest = 0.5f;

Vec3f randomOffset(std::mt19937& random, float most) {
  std::uniform_real_distribution<float> uniform(-most, most);
  return {uniform(random), uniform(random), uniform(random)};
}

uint32_t keyOf(const Vec3f& offset, float plane_distance) {
  return pointKey(offset, {pointShift(0), pointShift(1), pointShift(2)}, plane_distance);
}

TEST(Anchor, RoundingErrorIsAtMostHalfAStep) {
  std::mt19937 random(3);
  for (int i = 0; i < 10000; ++i) {
    const Vec3f offset = randomOffset(random, 0.975f);
    const uint16_t anchor = packAnchor(offset, kToNearest);
    ASSERT_NE(anchor, kNoAnchor);
    const Vec3f kept = anchorOffset(anchor);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_NEAR(component(kept, axis), component(offset, axis), 0.025f + 1e-6f);
    }
  }
}

/// The mean of the rounded anchor over evenly spaced dither values is exact.
TEST(Anchor, DitheringIsUnbiased) {
  for (const float offset : {-0.51f, -0.013f, 0.3f, 0.862f}) {
    double sum = 0.0;
    for (int i = 0; i < 256; ++i) {
      sum += anchorOffset(packAnchor({offset, 0.0f, 0.0f}, static_cast<float>(i) / 256.0f)).x;
    }
    EXPECT_NEAR(sum / 256.0, offset, 3e-4);
  }
}

/// The foot is the base of the perpendicular from the corner to the surface. Distances to the foot
/// are measured along the surface. So a point 0.9 voxels below the corner, here the foot itself, is
/// nearer than a point 0.4 voxels beside the corner.
TEST(PointKey, TheGreatestIsNearestToTheFoot) {
  const uint32_t foot = keyOf({0.0f, 0.0f, -0.9f}, 0.9f), beside = keyOf({0.4f, 0.0f, 0.0f}, 0.0f);
  EXPECT_GT(foot, beside);
  std::mt19937 random(5);
  for (int i = 0; i < 10000; ++i) {
    const Vec3f a = randomOffset(random, 1.0f), b = randomOffset(random, 1.0f);
    const float d = 0.3f * a.x;
    const float of_a = dot(a, a) - d * d, of_b = dot(b, b);
    if (std::abs(of_a - of_b) < 1.0f / 84.0f) continue;
    ASSERT_EQ(keyOf(a, d) > keyOf(b, 0.0f), of_a < of_b);
  }
}

}  // namespace anchor_test
}  // namespace dtsdf
