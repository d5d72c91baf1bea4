#include "kernels/core/grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <tuple>
#include <vector>

namespace dtsdf {
namespace grid_test {

std::vector<BlockKey> someKeys() {
  std::vector<BlockKey> keys;
  const int32_t limit = kMaxBlockCoordinate;
  for (const int32_t x : {-limit, -1, 0, 1, limit}) {
    for (const int32_t y : {-limit, -1, 0, 1, limit}) {
      for (const int32_t z : {-limit, -1, 0, 1, limit}) keys.push_back({x, y, z});
    }
  }
  std::mt19937 random(3);
  std::uniform_int_distribution<int32_t> uniform(-limit, limit);
  for (int i = 0; i < 1000; ++i)
    keys.push_back({uniform(random), uniform(random), uniform(random)});
  return keys;
}

TEST(Grid, UnpackingRestoresPackedKeys) {
  for (const BlockKey& key : someKeys()) {
    ASSERT_TRUE(isRepresentable(key));
    EXPECT_TRUE(unpackKey(packKey(key)) == key) << key.x << " " << key.y << " " << key.z;
  }
}

TEST(Grid, PackedKeysSortByZThenYThenX) {
  const std::vector<BlockKey> keys = someKeys();
  for (size_t i = 1; i < keys.size(); ++i) {
    const BlockKey &a = keys[i - 1], &b = keys[i];
    EXPECT_EQ(packKey(a) < packKey(b), std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x));
  }
}

TEST(Grid, KeysBeyondTheLimitsAreNotRepresentable) {
  const int32_t limit = kMaxBlockCoordinate;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int32_t outside : {-limit - 1, limit + 1, INT32_MIN, INT32_MAX}) {
      BlockKey key{0, 0, 0};
      (axis == 0 ? key.x : (axis == 1 ? key.y : key.z)) = outside;
      EXPECT_FALSE(isRepresentable(key)) << outside << " on axis " << axis;
    }
  }
}

TEST(Grid, BlockOfVoxelRoundsDown) {
  std::mt19937 random(4);
  std::uniform_int_distribution<int32_t> uniform(-8000000, 8000000);
  const auto below = [](int32_t x) { return static_cast<int32_t>(std::floor(x / 8.0)); };
  std::vector<int32_t> coordinates{-17, -16, -9, -8, -7, -1, 0, 1, 7, 8, 9, 16};
  for (int i = 0; i < 1000; ++i) coordinates.push_back(uniform(random));
  for (const int32_t x : coordinates) {
    const BlockKey block = blockOfVoxel({x, -x, x / 3});
    EXPECT_TRUE(block == (BlockKey{below(x), below(-x), below(x / 3)})) << x;
    const Vec3i inside = Vec3i{x, -x, x / 3} - firstVoxelOfBlock(block);
    EXPECT_TRUE(voxelOffset(voxelIndex(inside.x, inside.y, inside.z)) == inside);
  }
}

}  // namespace grid_test
}  // namespace dtsdf
