// Tests finding the cells through which triangles pass.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "kernels/core/vec.h"
#include "space/surface_cells.h"
#include "support/random_seed.h"

namespace dtsdf {
namespace {

BlockMesh meshOf(const BlockKey& key, const std::vector<Vec3f>& corners) {
  BlockMesh mesh;
  mesh.key = key;
  for (const Vec3f& corner : corners) {
    mesh.triangles.push_back(static_cast<uint16_t>(mesh.vertices.size()));
    mesh.vertices.push_back({corner, static_cast<uint32_t>(mesh.vertices.size())});
  }
  return mesh;
}

bool has(const std::vector<Vec3i>& cells, const Vec3i& cell) {
  return std::find(cells.begin(), cells.end(), cell) != cells.end();
}

/// All points of random triangles lie in the returned cells, and each returned cell is at most
/// about a tenth of its edge away from the nearest point.
TEST(CellsOfMesh, AreThoseThatTrianglesPassThrough) {
  std::mt19937 random(caseSeed(0));
  std::uniform_real_distribution<float> any(-1.9f, 9.9f);
  for (const int log2 : {0, 1, 2, 3}) {
    const auto side = static_cast<float>(cellSide(log2));
    for (int round = 0; round < 20; ++round) {
      const BlockKey key{round - 10, 3, -round};
      const auto point = [&] { return Vec3f{any(random), any(random), any(random)}; };
      const Vec3f a = point(), b = point(), c = point();
      const std::vector<Vec3i> cells = cellsOfMesh(meshOf(key, {a, b, c}), log2);
      std::vector<Vec3i> near;
      constexpr int kSteps = 200;
      for (int i = 0; i <= kSteps; ++i) {
        for (int j = 0; i + j <= kSteps; ++j) {
          const float s = static_cast<float>(i) / kSteps, t = static_cast<float>(j) / kSteps;
          const Vec3f p = toFloat(firstVoxelOfBlock(key)) + a + s * (b - a) + t * (c - a);
          const auto cellOf = [&](float x) { return floorToInt(x / side); };
          const Vec3i cell{cellOf(p.x), cellOf(p.y), cellOf(p.z)};
          ASSERT_TRUE(has(cells, cell)) << p.x << " " << p.y << " " << p.z << ", side " << side;
          const float kSlack = 0.1f * side + 0.05f;
          for (int k = 0; k < 8; ++k) {
            near.push_back({cellOf(p.x + (k & 1 ? kSlack : -kSlack)),
                            cellOf(p.y + (k & 2 ? kSlack : -kSlack)),
                            cellOf(p.z + (k & 4 ? kSlack : -kSlack))});
          }
        }
      }
      for (const Vec3i& cell : cells) EXPECT_TRUE(has(near, cell));
    }
  }
}

TEST(CellsOfMesh, ATriangleBetweenTwoCellsIsInTheUpperOne) {
  const BlockMesh mesh = meshOf({0, 0, -1}, {{1, 1, 4}, {3, 1, 4}, {1, 3, 4}});
  EXPECT_EQ(cellsOfMesh(mesh, {2}), (std::vector<Vec3i>{{0, 0, -1}}));
  EXPECT_EQ(cellsOfMesh(mesh, {3}), (std::vector<Vec3i>{{0, 0, -1}}));
}

/// A cell with triangles of two blocks stays until both blocks have removed their triangles.
TEST(SurfaceCells, StayWhileAnyBlockNeedsThem) {
  SurfaceCells surfaces(3, 2);
  CellTable cells;
  const std::vector<Vec3f> beyond = {{8.5f, 1, 1}, {9.5f, 1, 1}, {8.5f, 2, 1}};
  const std::vector<Vec3f> own = {{0.5f, 1, 1}, {1.5f, 1, 1}, {0.5f, 2, 1}};
  const Vec3i cell{1, 0, 0};
  const auto isThere = [&] {
    return isIn(cells.find(cubeOfCell(cell)).surface, indexInCube(cell));
  };
  EXPECT_EQ(surfaces.apply({meshOf({0, 0, 0}, beyond)}, cells).size(), 1u);
  EXPECT_TRUE(isThere());
  EXPECT_TRUE(surfaces.apply({meshOf({1, 0, 0}, own)}, cells).empty());
  EXPECT_TRUE(surfaces.apply({meshOf({0, 0, 0}, {})}, cells).empty());
  EXPECT_TRUE(isThere());
  EXPECT_EQ(surfaces.apply({meshOf({1, 0, 0}, {})}, cells).size(), 1u);
  EXPECT_FALSE(isThere());
  EXPECT_TRUE(cells.all().empty()) << "cubes without known cells should be removed";
}

}  // namespace
}  // namespace dtsdf
