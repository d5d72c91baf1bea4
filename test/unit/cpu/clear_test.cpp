// Clearing of a block on the CPU, many voxels at once, against the rule for each on its own.
#include "cpu/clear.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "kernels/fusion/free_space.h"
#include "support/most_free.h"

namespace dtsdf {
namespace {

/// Voxels in front of a camera with random distances, gaps and support, under random free depths:
/// those lose evidence that the rule contradicts, and no others.
TEST(Clear, TakesWhatTheRuleContradicts) {
  constexpr int kWidth = 64, kHeight = 48;
  constexpr float kVoxel_m = 0.02f;
  std::mt19937 random(11);
  std::uniform_real_distribution<float> sdf(-2.0f, 2.0f), free_m(0.9f, 1.4f);
  const FusionRules rules;
  BlockSums sums;
  VoxelStore store;
  store.resize(1);
  Voxel* voxels = store.array(0);
  int contradicted = 0, kept = 0;
  for (int round = 0; round < 60; ++round) {
    std::vector<float> free_depth(kWidth * kHeight);
    for (float& depth : free_depth) depth = random() % 50 == 0 ? 0.0f : free_m(random);
    const FrameView frame{
        kWidth,    kHeight, {60.0f, 60.0f, 31.5f, 23.5f}, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}},
        {0, 0, 0}, kVoxel_m};
    const std::vector<float> most_free = mostFreeOf(frame, free_depth);
    const FrameSensing sensing{{frame, nullptr, nullptr, nullptr, nullptr},
                               {0.0f, 0},
                               free_depth.data(),
                               most_free.data()};
    const int direction = round % 7 - 1;  // of the undirected map first
    const int array = direction == kAnyDirection ? 0 : direction;
    BlockEntry entry{};
    std::fill(entry.array, entry.array + kDirectionCount, kNoArray);
    entry.array[array] = 0;
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      const bool is_empty = random() % 3 == 0;
      voxels[i] = is_empty ? makeVoxel(0.0f, 0, -static_cast<int>(random() % 25))
                           : makeVoxel(sdf(random), 1 << 16, 19 + static_cast<int>(random() % 6));
      if (!is_empty && random() % 2) {
        voxels[i].anchor = packAnchor({0.5f * sdf(random), 0.5f * sdf(random), 0.25f}, 0.5f);
      }
      sums.voxel[array][i] = {0, random() % 3 == 0 ? 1 << 20 : 0, 0, 0};
    }
    findCovered(sums, array);
    const bool has_sums = round % 2 == 0;
    const std::vector<Voxel> before(voxels, voxels + kVoxelsPerBlock);
    const bool in_turn = !has_sums || round % 4 == 0;
    const BlockLook look{
        {0, 0, 6}, in_turn, has_sums ? &sums : nullptr, 1u << array, direction != kAnyDirection};
    clearBlock(look, entry, sensing, rules, store);
    const Vec3f first = toFloat(firstVoxelOfBlock(look.block_L));
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      const bool is_covered = has_sums && sums.voxel[array][i].weight != 0;
      const Sight sight = judge(sensing, first, before.data(), i, direction, is_covered);
      const bool expected = isJudged(before[i], is_covered, in_turn, rules) &&
                            isAgainst(sight, before[i], is_covered, rules);
      const int32_t frames = framesAgainst(sight, is_covered, rules);
      const Voxel after =
          expected ? contradictedVoxel(before[i], frames, is_covered, rules) : before[i];
      ASSERT_EQ(voxels[i].state, after.state) << round << " " << i;
      ++(expected ? contradicted : kept);
    }
  }
  EXPECT_GT(contradicted, 100);
  EXPECT_GT(kept, 100);
}

}  // namespace
}  // namespace dtsdf
