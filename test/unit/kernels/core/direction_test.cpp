#include "kernels/core/direction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "support/random_vectors.h"

namespace dtsdf {
namespace direction_test {

TEST(Direction, AxisAndSign) {
  const float axes[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (int d = 0; d < kDirectionCount; ++d) {
    const Vec3f v{axes[d][0], axes[d][1], axes[d][2]};
    EXPECT_EQ(component(v, directionAxis(d)), directionSign(d));
    EXPECT_EQ(directionCosine(v, d), 1.0f);
    EXPECT_EQ(directionCosine(v, d ^ 1), -1.0f);
    const DirectionSet set = directionsOf(v, true);
    ASSERT_EQ(set.count, 1) << "direction " << d;
    EXPECT_EQ(set.direction[0], d);
    EXPECT_EQ(set.weight[0], 1.0f);
  }
}

/// The set holds every direction whose cosine exceeds the threshold, once, with the cosine.
TEST(Direction, SetsAreWhatTheThresholdSays) {
  std::mt19937 random(5);
  for (int i = 0; i < 20000; ++i) {
    const Vec3f n = randomUnit(random);
    const float cosines[6] = {n.x, -n.x, n.y, -n.y, n.z, -n.z};
    const DirectionSet set = directionsOf(n, true);
    ASSERT_GE(set.count, 1);  // the greatest component is at least 1 / sqrt(3)
    ASSERT_LE(set.count, 3);
    uint32_t expected = 0;
    for (int d = 0; d < 6; ++d) expected |= (cosines[d] > kDirectionThreshold ? 1u : 0u) << d;
    EXPECT_EQ(directionMask(set), expected);
    std::set<int> seen;
    for (int k = 0; k < set.count; ++k) {
      EXPECT_TRUE(seen.insert(set.direction[k]).second);
      EXPECT_EQ(set.weight[k], cosines[set.direction[k]]);
    }
  }
}

TEST(Direction, TheUndirectedMapHasOneWithFullWeight) {
  const DirectionSet set = directionsOf({-0.6f, 0.0f, 0.8f}, false);
  ASSERT_EQ(set.count, 1);
  EXPECT_EQ(set.direction[0], 0);
  EXPECT_EQ(set.weight[0], 1.0f);
}

}  // namespace direction_test
}  // namespace dtsdf
