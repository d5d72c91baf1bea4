// The sums of blocks, of planes that are worked out side by side, against surfel after surfel.
#include "cpu/cast.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>

namespace dtsdf {
namespace {

constexpr int kSurfels = 4000;

FrameSensing sensingOf() {
  FrameView frame{};
  frame.width = kSurfels;
  frame.height = 1;
  frame.T_L_C = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {3.0f, -2.0f, -40.0f}};
  frame.origin_voxel = {-400, 80, 16};
  frame.voxel_size_m = 0.02f;
  return {{frame, nullptr, nullptr, nullptr, nullptr}, {0.0f, 0}, nullptr};
}

/// Of any normal, close together, some on corners of the grid.
std::vector<Surfel> crowdedSurfels(std::mt19937& random) {
  std::uniform_real_distribution<float> position(-12.0f, 12.0f), weight(0.0f, 1.0f);
  std::normal_distribution<float> normal;
  std::vector<Surfel> surfels;
  for (int i = 0; i < kSurfels; ++i) {
    Vec3f p{position(random), position(random), position(random)};
    if (i % 9 == 0) p = {std::floor(p.x), std::floor(p.y), std::floor(p.z)};
    const Vec3f n{normal(random), normal(random), normal(random)};
    surfels.push_back({p, weight(random), (1.0f / norm(n)) * n, 1.0f});
  }
  return surfels;
}

/// A surfel at a time, by the rule for one.
void castOneByOne(const TouchedBlock& block, const std::vector<Surfel>& surfels,
                  const FrameSensing& sensing, const FusionSettings& fusion, BlockSums& sums) {
  for (const Surfel& surfel : surfels) {
    if (!(surfel.weight > 0.0f)) continue;
    const CastLine line = makeCastLine(surfel, sensing, fusion);
    auto add = [&](const Vec3i& voxel_L, const CornerSample& sample, int32_t sdf) {
      if (!(blockOfVoxel(voxel_L) == block.block_L)) return;
      for (int d = 0; d < line.directions.count; ++d) {
        const int32_t weight = roundWeight(sample.share * line.directions.weight[d]);
        addToSums(sums.voxel[line.directions.direction[d]][indexInBlock(voxel_L)], weight, sdf,
                  sample.point_key);
      }
    };
    castSurfel(line, fusion, add);
  }
}

class Cast : public testing::TestWithParam<bool> {};

TEST_P(Cast, SumsAreThoseOfSurfelAfterSurfel) {
  std::mt19937 random(31);
  const FrameSensing sensing = sensingOf();
  const std::vector<Surfel> surfels = crowdedSurfels(random);
  const FusionSettings fusion{GetParam(), 1, 4.0f, 64.0f, FusionRules()};
  BlockFinder finder(fusion, 2);
  finder.findBlocks({surfels}, sensing);
  ASSERT_GT(finder.touched().size(), 20u);
  const auto sums = std::make_unique<BlockSums>(), expected = std::make_unique<BlockSums>();
  int added = 0;
  for (const TouchedBlock& block : finder.touched()) {
    *expected = BlockSums{};
    castOneByOne(block, surfels, sensing, fusion, *expected);
    *sums = BlockSums{};
    cast(block, finder, fusion, *sums);
    for (int d = 0; d < kDirectionCount; ++d) {
      for (int i = 0; i < kVoxelsPerBlock; ++i) {
        const VoxelSums &is = sums->voxel[d][i], &should = expected->voxel[d][i];
        ASSERT_EQ(is.weight, should.weight) << d << ' ' << i;
        ASSERT_EQ(is.weighted_sdf, should.weighted_sdf) << d << ' ' << i;
        ASSERT_EQ(is.nearest, should.nearest) << d << ' ' << i;
        added += is.weight > 0 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(added, 20000);
}

INSTANTIATE_TEST_SUITE_P(AlongNormalsAndRays, Cast, testing::Bool());

}  // namespace
}  // namespace dtsdf
