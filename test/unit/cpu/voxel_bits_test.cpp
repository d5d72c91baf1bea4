// Bits of voxels and units against the voxels themselves.
#include "cpu/voxel_bits.h"

#include <gtest/gtest.h>

#include <random>

#include "kernels/render/depth_range.h"

namespace dtsdf {
namespace {

constexpr int32_t kLeastEvidence = 2;

/// A block and the seven after it, one of which the map has not; voxels of all kinds at random.
struct Blocks {
  BlockTable table{size_t{64} << 20};
  VoxelStore voxels;
  const BlockKey key{-1, 0, 2};
  VoxelBits bits[kCubeCorners];
  const VoxelBits* around[kCubeCorners] = {};

  explicit Blocks(uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<BlockRequest> requests;
    for (int c = 0; c < kCubeCorners; ++c) {
      if (c != 5) requests.push_back({packKey(keyOf(c)), c % 2 ? 0x3fu : 0x15u});
    }
    const Admission admission = table.admit(requests);
    voxels.resize(table.arrayCount());
    for (const int32_t array : admission.new_arrays) {
      for (int i = 0; i < kVoxelsPerBlock; ++i) {
        const auto sdf = static_cast<int16_t>(static_cast<int>(random() % 4100) - 1000);
        voxels.array(array)[i] =
            makeVoxel(sdf, kNoAnchor, random() % 3, static_cast<int32_t>(random() % 5) - 1);
      }
    }
    for (int c = 0; c < kCubeCorners; ++c) {
      const int32_t slot = table.find(packKey(keyOf(c)));
      if (slot < 0) continue;
      bits[c] = voxelBitsOf(table.block(slot), voxels, kLeastEvidence);
      around[c] = &bits[c];
    }
  }
  BlockKey keyOf(int c) const { return key + Vec3i{c & 1, c >> 1 & 1, c >> 2}; }

  /// Null where the map has no such voxel.
  const Voxel* voxelAt(const Vec3i& at, int direction) const {
    const int32_t slot = table.find(packKey(key + blockOfVoxel(at)));
    const int32_t array = slot < 0 ? kNoArray : table.block(slot).array[direction];
    if (array == kNoArray) return nullptr;
    return voxels.array(array) + voxelIndex(at.x & 7, at.y & 7, at.z & 7);
  }
  bool isKnownAt(const Vec3i& at, int direction) const {
    const Voxel* voxel = voxelAt(at, direction);
    return voxel != nullptr && isKnown(*voxel, kLeastEvidence);
  }
};

template <class Holds>
bool inAnyDirection(const Holds& holds) {
  bool any = false;
  for (int d = 0; d < kDirectionCount; ++d) any = any || holds(d);
  return any;
}

TEST(VoxelBits, SayWhatTheVoxelsHold) {
  const Blocks blocks(1);
  for (int i = 0; i < kVoxelsPerBlock; ++i) {
    const Vec3i at = voxelOffset(i);
    const auto known = [&](int d) { return blocks.isKnownAt(at, d); };
    EXPECT_EQ(has(blocks.bits[0].known, at), inAnyDirection(known));
    EXPECT_EQ(has(blocks.bits[0].behind, at), inAnyDirection([&](int d) {
                return known(d) && sdfOf(*blocks.voxelAt(at, d)) < 0.0f;
              }));
    EXPECT_EQ(has(blocks.bits[0].near, at), inAnyDirection([&](int d) {
                return known(d) && isNearRay(*blocks.voxelAt(at, d), kLeastEvidence);
              }));
    for (int d = 0; d < kDirectionCount; ++d) EXPECT_EQ(has(blocks.bits[0].seen[d], at), known(d));
  }
}

TEST(UnitBits, JoinTheCornersOfUnitsAlsoInOtherBlocks) {
  int all_known = 0;
  for (uint32_t seed = 1; seed < 20; ++seed) {
    const Blocks blocks(seed);
    const UnitBits units = unitBitsOf(blocks.around);
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      const Vec3i at = voxelOffset(i);
      bool known = true, behind = false, seen[kDirectionCount] = {};
      for (int c = 0; c < kCubeCorners; ++c) {
        const Vec3i corner = at + Vec3i{c & 1, c >> 1 & 1, c >> 2};
        known = known && inAnyDirection([&](int d) { return blocks.isKnownAt(corner, d); });
        for (int d = 0; d < kDirectionCount; ++d) {
          const bool is_known = blocks.isKnownAt(corner, d);
          seen[d] = seen[d] || is_known;
          behind = behind || (is_known && sdfOf(*blocks.voxelAt(corner, d)) < 0.0f);
        }
      }
      EXPECT_EQ(has(units.known, at), known);
      EXPECT_EQ(has(units.behind, at), behind);
      for (int d = 0; d < kDirectionCount; ++d) EXPECT_EQ(has(units.seen[d], at), seen[d]);
      all_known += known ? 1 : 0;
    }
  }
  EXPECT_GT(all_known, 50);
}

}  // namespace
}  // namespace dtsdf
