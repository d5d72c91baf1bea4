#include "kernels/core/direction.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "support/random_vectors.h"

namespace dtsdf {
namespace direction_test {

/// A direction is in the set, exactly once, if the cosine of its angle to the normal exceeds the
/// threshold. Its weight is that cosine.
TEST(Direction, SetsFollowTheThreshold) {
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

}  // namespace direction_test
}  // namespace dtsdf
