#include "map/block_cells.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "kernels/fusion/free_space.h"
#include "map/block_table.h"

namespace dtsdf {
namespace {

constexpr size_t kUnbounded = size_t(1) << 30;

/// A randomly oriented camera in the block `at`.
FrameView randomView(std::mt19937& random, const BlockKey& at) {
  std::normal_distribution<float> normal;
  float q[4];
  for (float& part : q) part = normal(random);
  const float length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const float w = q[0] / length, x = q[1] / length, y = q[2] / length, z = q[3] / length;
  FrameView view = {};
  view.width = 640;
  view.height = 480;
  const float focal_px = std::uniform_real_distribution<float>(60.0f, 2000.0f)(random);
  view.intrinsics = {focal_px, focal_px, 319.5f, 100.0f};
  view.T_L_C.R[0] = 1 - 2 * (y * y + z * z);
  view.T_L_C.R[1] = 2 * (x * y - z * w);
  view.T_L_C.R[2] = 2 * (x * z + y * w);
  view.T_L_C.R[3] = 2 * (x * y + z * w);
  view.T_L_C.R[4] = 1 - 2 * (x * x + z * z);
  view.T_L_C.R[5] = 2 * (y * z - x * w);
  view.T_L_C.R[6] = 2 * (x * z - y * w);
  view.T_L_C.R[7] = 2 * (y * z + x * w);
  view.T_L_C.R[8] = 1 - 2 * (x * x + y * y);
  view.T_L_C.t = {3.0f, 4.0f, 5.0f};
  view.origin_voxel = firstVoxelOfBlock(at);
  view.voxel_size_m = 0.02f;
  return view;
}

BlockKey randomBlock(std::mt19937& random, const BlockKey& around, int reach) {
  std::uniform_int_distribution<int> offset(-reach, reach);
  return {around.x + offset(random), around.y + offset(random), around.z + offset(random)};
}

/// Moves a block to a corner of its coarse cell (see BlockCells). If the cell's bounds were too
/// small, blocks at its corners would be the first to be missed.
BlockKey cornerOfCell(std::mt19937& random, const BlockKey& block) {
  const auto snap = [&](int32_t at) {
    const int32_t first = at & ~(BlockCells::kSide - 1);
    return random() % 2 == 0 ? first : first + BlockCells::kSide - 1;
  };
  return {snap(block.x), snap(block.y), snap(block.z)};
}

TEST(BlockCells, ListEachBlockOnce) {
  std::mt19937 random(1);
  BlockTable table(kUnbounded);
  std::set<PackedKey> live;
  for (int step = 0; step < 4000; ++step) {
    const PackedKey key = packKey(randomBlock(random, {-7, 0, 9}, 30));
    const int32_t slot = table.find(key);
    if (slot < 0) {
      table.admit({{key, 1}});
      live.insert(key);
    } else {
      table.release(slot, 1);
      live.erase(key);
    }
  }
  const FrameView view = randomView(random, {0, 0, 0});
  constexpr float kEverything = 1e6f;
  std::set<PackedKey> listed;
  for (const int32_t slot : table.slotsInView(view, kEverything)) {
    EXPECT_TRUE(listed.insert(packKey(table.block(slot).key)).second);
  }
  EXPECT_EQ(listed, live);
}

/// The camera is near the origin or near the largest keys, where floats are coarse.
TEST(BlockCells, ListAllBlocksInViewAndFewOthers) {
  std::mt19937 random(2);
  constexpr int kFar = kMaxBlockCoordinate - 700;
  size_t in_view = 0, listed = 0, all = 0;
  for (const BlockKey& at : {BlockKey{0, 0, 0}, BlockKey{-kFar, 5000, kFar}}) {
    BlockTable table(kUnbounded);
    std::vector<BlockRequest> requests;
    for (int i = 0; i < 20000; ++i) {
      const BlockKey block = cornerOfCell(random, randomBlock(random, at, 600));
      requests.push_back({packKey(block), 1});
    }
    table.admit(requests);
    for (int i = 0; i < 20; ++i) {
      const BlockKey camera = i % 2 == 0 ? at : BlockKey{at.x / 2, at.y, at.z};
      const FrameView view = randomView(random, camera);
      const std::vector<int32_t> slots = table.slotsInView(view, kFootRadius);
      const std::set<int32_t> found(slots.begin(), slots.end());
      for (const int32_t slot : table.sortedSlots()) {
        if (!mayBeInView(view, table.block(slot).key - camera)) continue;
        EXPECT_EQ(found.count(slot), 1u);
        ++in_view;
      }
      listed += found.size();
      all += table.blocksInUse();
    }
  }
  EXPECT_GT(in_view, all / 100) << "the test should have enough blocks in view";
  EXPECT_LT(listed - in_view, all / 10) << "few blocks outside the view should be listed";
}

}  // namespace
}  // namespace dtsdf
