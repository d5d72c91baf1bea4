#include "meshing/packed_chunk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <set>

namespace dtsdf {
namespace {

constexpr int kCellLog2 = 10;
constexpr int kCell = 1 << kCellLog2;

/// A grid of `side` x `side` squares, each 256 wide, at height z, all in steps of the packed
/// coordinates. The grid faces up if `faces` is 1, and down if it is -1.
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

TEST(CoarseChunk, HasAboutASixteenthOfTheTriangles) {
  const PackedChunk fine = gridChunk({-5 * kCell, 0, 7}, 64, 3000, 1.0f);
  const PackedChunk coarse = coarsen(fine, kCellLog2);
  EXPECT_LE(coarse.triangleCount(), fine.triangleCount() / 15);
  EXPECT_GE(coarse.triangleCount(), fine.triangleCount() / 17);
  ASSERT_EQ(coarse.colours.size(), 3 * coarse.vertexCount());
  std::set<double> heights;
  for (size_t i = 0; i < coarse.vertexCount(); ++i) {
    heights.insert(positionOf(coarse, kCell / 4.0, i)[2]);
  }
  ASSERT_EQ(heights.size(), 1u);
  EXPECT_LE(std::abs(*heights.begin() - 3007.0), 0.75 * kCell);
  for (size_t i = 0; i < 3 * coarse.triangleCount(); ++i) {
    ASSERT_LT(coarse.corner(i), coarse.vertexCount());
  }
}

TEST(CoarseChunk, KeepsTheSidesOfThinObjectsApart) {
  const PackedChunk front = coarsen(gridChunk({0, 0, 0}, 8, 1500, 1.0f), kCellLog2);
  const PackedChunk back = coarsen(gridChunk({0, 0, 0}, 8, 1490, -1.0f), kCellLog2);
  EXPECT_GT(front.positions[2], back.positions[2]);
}

/// The positions of a chunk's vertices. @param step The unit of the packed coordinates.
std::set<std::array<double, 3>> placesOf(const PackedChunk& chunk, double step) {
  std::set<std::array<double, 3>> places;
  for (size_t i = 0; i < chunk.vertexCount(); ++i) places.insert(positionOf(chunk, step, i));
  return places;
}

/// All vertices lie just below the border between the two chunks. The large cells in which vertices
/// are merged begin below the upper chunk.
TEST(CoarseChunk, MeetsItsNeighbourDespiteLargeCells) {
  constexpr int kVoxel = 512, kSide = 32 * kVoxel, kMargin = 2 * kVoxel, kBelow = 154;
  const int lower_z = kSide + kMargin - kBelow, upper_z = kMargin - kBelow;
  for (const float faces : {1.0f, -1.0f}) {
    const PackedChunk lower = gridChunk({0, 0, -kMargin}, 64, lower_z, faces);
    const PackedChunk upper = gridChunk({0, 0, kSide - kMargin}, 64, upper_z, faces);
    ASSERT_EQ(placesOf(lower, 1.0), placesOf(upper, 1.0));
    EXPECT_EQ(placesOf(coarsen(lower, 13), 2048.0), placesOf(coarsen(upper, 13), 2048.0));
  }
}

/// Both chunks have vertices on the border between them. The chunks' origins are not multiples of
/// the cell size.
TEST(CoarseChunk, MeetsItsNeighbour) {
  const PackedChunk left = coarsen(gridChunk({100, 300, 0}, 16, 1500, 1.0f), kCellLog2);
  const PackedChunk right = coarsen(gridChunk({100 + 16 * 256, 300, 0}, 16, 1500, 1.0f), kCellLog2);
  const auto places = placesOf(left, kCell / 4.0);
  size_t shared = 0;
  for (const auto& place : placesOf(right, kCell / 4.0)) shared += places.count(place);
  EXPECT_GE(shared, 4u);
}

}  // namespace
}  // namespace dtsdf
