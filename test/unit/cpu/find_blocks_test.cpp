// Sorting surfels by block against a plain loop over all pairs.
#include "cpu/find_blocks.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <random>
#include <set>
#include <utility>

namespace dtsdf {
namespace {

struct Expected {
  uint32_t directions = 0;
  std::set<uint32_t> surfels;
};

class FindBlocks : public testing::TestWithParam<int> {};

std::vector<Surfel> randomSurfels(std::mt19937& random, const FrameView& frame) {
  std::uniform_real_distribution<float> position(-60.0f, 60.0f);
  std::normal_distribution<float> normal;
  std::vector<Surfel> surfels;
  for (int i = 0; i < frame.width * frame.height; ++i) {
    const Vec3f n{normal(random), normal(random), normal(random)};
    surfels.push_back({{position(random), position(random), position(random)},
                       random() % 5 == 0 ? 0.0f : 1.0f,
                       (1.0f / norm(n)) * n,
                       1.0f});
  }
  return surfels;
}

std::map<PackedKey, Expected> binOneByOne(const std::vector<Surfel>& surfels,
                                          const FrameSensing& sensing,
                                          const FusionSettings& fusion) {
  const BlockKey origin = blockOfVoxel(sensing.image.frame.origin_voxel);
  std::map<PackedKey, Expected> bins;
  for (uint32_t i = 0; i < surfels.size(); ++i) {
    if (!(surfels[i].weight > 0.0f)) continue;
    const SampleLine line = sampleLineOf(surfels[i], sensing, fusion);
    visitBlocks(line, [&](const Vec3i& block) {
      Expected& bin = bins[packKey(block + origin)];
      bin.directions |= directionMask(directionsOf(surfels[i].normal_L, true));
      bin.surfels.insert(i);
    });
  }
  return bins;
}

TEST_P(FindBlocks, EverySurfelIsOnceInEachBlockThatItTouches) {
  FrameView frame{};
  frame.width = 61;
  frame.height = 47;
  frame.T_L_C = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {100.0f, 90.0f, 80.0f}};
  frame.origin_voxel = {-4000, 800, 16};
  frame.voxel_size_m = 0.02f;  // without it, lines have no length
  std::mt19937 random(25);
  const FrameSensing sensing{{frame, nullptr, nullptr, nullptr, nullptr}, {0.0f, 0}, nullptr};
  for (const int cast_along_normal : {0, 1}) {
    const FusionSettings fusion{cast_along_normal, 1, 4.0f, 1e6f, FusionRules()};
    BlockFinder finder(fusion, GetParam());
    const std::vector<Surfel> surfels = randomSurfels(random, frame);
    const std::map<PackedKey, Expected> expected = binOneByOne(surfels, sensing, fusion);
    ASSERT_GT(expected.size(), 1000u);
    finder.findBlocks({surfels}, sensing);
    const std::vector<TouchedBlock>& touched = finder.touched();
    std::set<PackedKey> keys;
    for (const TouchedBlock& block : touched) {
      ASSERT_TRUE(keys.insert(block.key).second) << "a block appears twice";
      ASSERT_EQ(expected.count(block.key), 1u);
      EXPECT_EQ(packKey(block.block_L + blockOfVoxel(frame.origin_voxel)), block.key);
      EXPECT_EQ(block.directions, expected.at(block.key).directions);
      std::multiset<uint32_t> members;
      for (const SurfelRange& range : block.surfels) members.insert(range.begin, range.end);
      const std::set<uint32_t>& wanted = expected.at(block.key).surfels;
      EXPECT_EQ(members, std::multiset<uint32_t>(wanted.begin(), wanted.end()));
    }
    EXPECT_EQ(keys.size(), expected.size());
  }
}

/// Side by side as one at a time, bit by bit, whatever part of a stretch a surfel is.
TEST(LinesOfSurfels, AreThoseOfOneAtATime) {
  FrameView frame{};
  frame.width = 17;
  frame.height = 11;
  frame.intrinsics = {500.0f, 500.0f, 8.0f, 5.0f};
  frame.T_L_C = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {100.0f, 90.0f, 80.0f}};
  frame.voxel_size_m = 0.02f;
  std::mt19937 random(26);
  const FrameSensing sensing{{frame, nullptr, nullptr, nullptr, nullptr}, {0.01f, 1}, nullptr};
  std::vector<Surfel> surfels = randomSurfels(random, frame);
  for (size_t i = 0; i < surfels.size(); ++i) {
    surfels[i].weight *= 0.1f + 0.001f * static_cast<float>(i);
    surfels[i].depth_m = 0.5f + 0.01f * static_cast<float>(i);
    if (i % 3 == 0) surfels[i].footprint_px = {0.5f, 0.25f};
  }
  for (const auto& [along_normal, directional] : {std::pair{1, 0}, {1, 1}, {0, 0}, {0, 1}}) {
    const FusionSettings fusion{along_normal, directional, 4.0f, 1e6f, FusionRules()};
    BlockFinder finder(fusion, 2);
    finder.findBlocks({surfels}, sensing);
    for (uint32_t i = 0; i < surfels.size(); ++i) {
      if (!(surfels[i].weight > 0.0f)) continue;
      const CastLine expected = makeCastLine(surfels[i], sensing, fusion);
      const KeptLine& kept = finder.line(i);
      EXPECT_EQ(0, std::memcmp(&kept.line, &expected.line, sizeof(kept.line)));
      EXPECT_EQ(kept.directions, directionMask(expected.directions));
      EXPECT_EQ(0, std::memcmp(kept.weight, expected.directions.weight, sizeof(kept.weight)));
      ASSERT_EQ(kept.has_sides, expected.sides.areMeasured());
      if (!kept.has_sides) continue;
      EXPECT_EQ(0, std::memcmp(&finder.sides(i), &expected.sides, sizeof(expected.sides)));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, FindBlocks, testing::Values(1, 2, 3, 8));

}  // namespace
}  // namespace dtsdf
