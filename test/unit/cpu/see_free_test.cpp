// What the CPU sees free of many cells at once against the rule for each on its own.
#include "cpu/see_free.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <tuple>
#include <vector>

#include "kernels/space/see_free.h"

namespace dtsdf {
namespace {

constexpr int kSeenWidth = 64, kSeenHeight = 48;

/// Far walls with nearer bodies before them, and pixels that tell nothing.
std::vector<float> randomFreeDepths(std::mt19937& random) {
  std::vector<float> depths(kSeenWidth * kSeenHeight, 4.0f);
  std::uniform_real_distribution<float> near_m(0.8f, 3.0f);
  for (int body = 0; body < 6; ++body) {
    const float depth_m = body == 0 ? 0.0f : near_m(random);
    const int left = static_cast<int>(random() % 56), top = static_cast<int>(random() % 40);
    for (int v = top; v < top + 8; ++v) {
      for (int u = left; u < left + 8; ++u) {
        depths[static_cast<size_t>(v) * kSeenWidth + static_cast<size_t>(u)] = depth_m;
      }
    }
  }
  return depths;
}

/// With the least free depths in all levels that there are.
FreePyramid pyramidOf(std::vector<std::vector<float>>& levels) {
  FreePyramid free{{levels[0].data()}, kSeenWidth, kSeenHeight};
  for (int k = 1; k < kFreeLevels; ++k) {
    const int width = texelsFor(kSeenWidth, k), height = texelsFor(kSeenHeight, k);
    levels[k].resize(static_cast<size_t>(width) * static_cast<size_t>(height));
    for (int i = 0; i < width * height; ++i) {
      levels[k][static_cast<size_t>(i)] =
          leastBelow(levels[k - 1].data(), texelsFor(kSeenWidth, k - 1),
                     texelsFor(kSeenHeight, k - 1), i % width, i / width);
    }
    free.level[k] = levels[k].data();
  }
  return free;
}

TEST(FreeCellFinder, SeesTheCellsThatTheRuleCallsFree) {
  std::mt19937 random(5);
  MapperParams params;
  params.map.voxel_size_m = 0.05f;
  params.space.cell_voxels = 2;
  params.space.max_range_m = 2.4f;
  const CellGrid grid = cellGridOf(params);
  FreeCellFinder finder(params, 2);
  std::vector<Vec3i> cubes;  // behind the camera, around it, in view and beside
  for (int i = 0; i < 7 * 7 * 7; ++i) cubes.push_back({i / 49 - 3, i / 7 % 7 - 3, i % 7 - 2});
  int free_cells = 0, other_cells = 0;
  for (int round = 0; round < 4; ++round) {
    const FrameView frame{kSeenWidth,
                          kSeenHeight,
                          {60.0f, 60.0f, 31.5f, 23.5f},
                          {{0.8f, 0, 0.6f, 0, 1, 0, -0.6f, 0, 0.8f}, {0.3f, 0.2f, 0.1f}},
                          {0, 0, 0},
                          params.map.voxel_size_m};
    std::vector<std::vector<float>> levels(kFreeLevels);
    levels[0] = randomFreeDepths(random);
    const FreePyramid free = pyramidOf(levels);
    const FrameSensing sensing{
        {frame, nullptr, nullptr, nullptr, nullptr}, {0.0f, 0}, levels[0].data()};
    std::map<std::tuple<int, int, int>, CellMask> seen;
    for (const FreeCube& cube : finder.find(sensing, cubes)) {
      seen[{cube.key.x, cube.key.y, cube.key.z}] = cube.free;
    }
    for (const Vec3i& cube : cubes) {
      const auto found = seen.find({cube.x, cube.y, cube.z});
      const CubeLook look = lookAt(frame, grid, cube);
      const auto corner = [&](int x, int y, int z) { return cornerInImage(frame, look, x, y, z); };
      for (int cell = 0; cell < kCellsPerCube; ++cell) {
        const bool expected = isCellSeenFree(free, corner, cell, params.space.max_range_m);
        ASSERT_EQ(found != seen.end() && isIn(found->second, cell), expected) << cell;
        ++(expected ? free_cells : other_cells);
      }
    }
  }
  EXPECT_GT(free_cells, 1000);
  EXPECT_GT(other_cells, 1000);
}

}  // namespace
}  // namespace dtsdf
