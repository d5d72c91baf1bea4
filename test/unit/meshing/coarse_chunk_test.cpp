#include "meshing/packed_chunk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <set>

namespace dtsdf {
namespace {

constexpr int kCellLog2 = 10;
constexpr int kCell = 1 << kCellLog2;

/// A square grid of `side` cells of 256 steps at a height of z steps, facing up or down.
PackedChunk gridChunk(std::array<int64_t, 3> origin, int side, int z, float faces) {
  PackedChunk chunk;
  chunk.origin = origin;
  const auto [u, v] = packedNormal({0.0f, 0.0f, faces});
  for (int y = 0; y <= side; ++y) {
    for (int x = 0; x <= side; ++x) {
      for (const int p : {256 * x, 256 * y, z}) {
        chunk.positions.push_back(static_cast<uint16_t>(p));
      }
      chunk.normals.push_back(u);
      chunk.normals.push_back(v);
      chunk.colours.insert(chunk.colours.end(), {1, 2, 3});
    }
  }
  const auto number = [&](int x, int y) { return static_cast<uint16_t>(x + (side + 1) * y); };
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      for (const uint16_t i : {number(x, y), number(x + 1, y), number(x + 1, y + 1), number(x, y),
                               number(x + 1, y + 1), number(x, y + 1)}) {
        chunk.triangles16.push_back(i);
      }
    }
  }
  return chunk;
}

TEST(CoarseChunk, HasASixteenthOfTheTrianglesNearTheSamePlace) {
  const PackedChunk fine = gridChunk({-5 * kCell, 0, 7}, 64, 3000, 1.0f);
  const PackedChunk coarse = coarsen(fine, kCellLog2);
  EXPECT_LE(coarse.triangleCount(), fine.triangleCount() / 15);
  EXPECT_GE(coarse.triangleCount(), fine.triangleCount() / 17);
  ASSERT_EQ(coarse.colours.size(), 3 * coarse.vertexCount());
  std::set<uint16_t> heights;
  for (size_t i = 0; i < coarse.vertexCount(); ++i) heights.insert(coarse.positions[3 * i + 2]);
  ASSERT_EQ(heights.size(), 1u);
  EXPECT_LE(std::abs(*heights.begin() - 3000), 3 * kCell / 4);
  for (size_t i = 0; i < 3 * coarse.triangleCount(); ++i) {
    ASSERT_LT(coarse.corner(i), coarse.vertexCount());
  }
}

TEST(CoarseChunk, KeepsBothSidesOfAThinThingApart) {
  const PackedChunk front = coarsen(gridChunk({0, 0, 0}, 8, 1500, 1.0f), kCellLog2);
  const PackedChunk back = coarsen(gridChunk({0, 0, 0}, 8, 1490, -1.0f), kCellLog2);
  EXPECT_GT(front.positions[2], back.positions[2]);
}

/// Both chunks have vertices on their common side, and their origins are not multiples of the
/// cells.
TEST(CoarseChunk, MeetsItsNeighbour) {
  const PackedChunk left = coarsen(gridChunk({100, 300, 0}, 16, 1500, 1.0f), kCellLog2);
  const PackedChunk right = coarsen(gridChunk({100 + 16 * 256, 300, 0}, 16, 1500, 1.0f), kCellLog2);
  std::set<std::array<double, 3>> places;
  for (size_t i = 0; i < left.vertexCount(); ++i) places.insert(positionOf(left, 1.0, i));
  size_t shared = 0;
  for (size_t i = 0; i < right.vertexCount(); ++i) {
    shared += places.count(positionOf(right, 1.0, i));
  }
  EXPECT_GE(shared, 4u);
}

}  // namespace
}  // namespace dtsdf
