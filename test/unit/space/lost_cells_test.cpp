// What the disk does not give is no fact: distances are never greater than they should be.
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <thread>

#include "space/cell_table.h"
#include "space/distance_field.h"
#include "space/surface_cells.h"
#include "support/page_faults.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

constexpr int kWalls = 64, kReach = 10;

/// In sectors of their own, at the border to the next ones.
Vec3i cubeOfWall(int i) { return {8 * i + 3, 0, 0}; }
CellMask wall() {
  CellMask mask{};
  for (int z = 0; z < kCubeSide; ++z) {
    for (int y = 0; y < kCubeSide; ++y) add(mask, cellIndex(7, y, z));
  }
  return mask;
}
/// Three cells before a wall.
Vec3i cellBefore(int i) { return firstCellOfCube(cubeOfWall(i)) + Vec3i{4, 4, 4}; }
Vec3i cellIn(int i) { return firstCellOfCube(cubeOfWall(i)) + Vec3i{7, 4, 4}; }

/// In the sector behind, within reach.
CubeMask cubeBehind(int i) {
  CubeMask behind{cubeOfWall(i) + Vec3i{1, 0, 0}, {}};
  add(behind.cells, cellIndex(4, 4, 4));
  return behind;
}

class LostCells : public testing::Test {
 protected:
  TemporaryFolder folder_;
  SharedPagedValues pages_ = std::make_shared<PagedValues>(folder_.path(), size_t{64} << 20, 1);

  void waitUntilWritten() const {
    for (int i = 0; i < 5000 && pages_->bytes() > 1; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ASSERT_LE(pages_->bytes(), 1u) << "else nothing is tested";
  }
};

class LostSurfaces : public LostCells {
 protected:
  DistanceField field_{kReach, 2, pages_};

  void build() {
    std::vector<CubeMask> walls;
    for (int i = 0; i < kWalls; ++i) walls.push_back({cubeOfWall(i), wall()});
    field_.update(walls);
    for (int i = 0; i < kWalls; ++i) ASSERT_EQ(squaredAt(field_.sectors(), cellBefore(i)), 9);
    waitUntilWritten();
  }
  void updateBehind() {
    std::vector<CubeMask> behind;
    for (int i = 0; i < kWalls; ++i) behind.push_back(cubeBehind(i));
    field_.update(behind);
  }
  void expectSafe() const {
    for (int i = 0; i < kWalls; ++i) {
      const int squared = squaredAt(field_.sectors(), cellBefore(i));
      ASSERT_GE(squared, 0) << i;
      ASSERT_LE(squared, 9) << i;
    }
  }
};

TEST_F(LostSurfaces, AreFeltUntilTheirCubesAreToldAgain) {
  ASSERT_NO_FATAL_FAILURE(build());
  overwritePages(folder_.path());
  updateBehind();
  ASSERT_NO_FATAL_FAILURE(expectSafe());
  std::vector<CubeMask> one, all;
  for (int i = 0; i < kWalls; ++i) {
    const Vec3i sector = sectorOfCube(cubeOfWall(i));
    one.push_back({cubeOfSector(sector, 0), wall()});
    for (int k = 0; k < kCubesPerSector; ++k) {
      const Vec3i cube = cubeOfSector(sector, k);
      all.push_back({cube, cube == cubeOfWall(i) ? wall() : CellMask{}});
    }
  }
  field_.update(one);
  ASSERT_NO_FATAL_FAILURE(expectSafe());
  field_.update(all);
  for (int i = 0; i < kWalls; ++i) {
    ASSERT_EQ(squaredAt(field_.sectors(), cellBefore(i)), 9);
    ASSERT_EQ(squaredAt(field_.sectors(), cellIn(i) - Vec3i{11, 0, 0}), -1);
  }
}

TEST_F(LostSurfaces, AreFeltWhileTheDiskIsAway) {
  ASSERT_NO_FATAL_FAILURE(build());
  CellMask moved{};
  add(moved, cellIndex(5, 4, 4));
  std::vector<CubeMask> changed;
  for (int i = 0; i < kWalls; ++i) changed.push_back({cubeOfWall(i), moved});
  {
    const DiskOutage outage(folder_.path());
    updateBehind();
    ASSERT_NO_FATAL_FAILURE(expectSafe());
    field_.update(changed);
    for (int i = 0; i < kWalls; ++i) ASSERT_LE(squaredAt(field_.sectors(), cellBefore(i)), 1);
  }
  ASSERT_NO_FATAL_FAILURE(expectSafe());
  EXPECT_GT(pages_->stats().failures, 0u);
}

class LostCubes : public LostCells {
 protected:
  CellTable table_{pages_};

  void touch() {
    for (int i = 0; i < kWalls; ++i) table_.at(cubeOfWall(i)).surface = wall();
    table_.close();
    waitUntilWritten();
  }
  /// @return how many were handed out, all of them walls.
  int take(bool all) {
    const SpaceChanges taken = table_.takeTouched(all, 1000);
    for (const SpaceCube& cube : taken.cubes) {
      EXPECT_TRUE(std::equal(cube.surface.begin(), cube.surface.end(), wall().word));
    }
    EXPECT_FALSE(taken.is_part);
    return static_cast<int>(taken.cubes.size());
  }
};

TEST_F(LostCubes, AreHandedOutWhenTheyCanBeRead) {
  ASSERT_NO_FATAL_FAILURE(touch());
  EXPECT_EQ(take(true), kWalls);
  ASSERT_NO_FATAL_FAILURE(touch());
  std::optional<DiskOutage> outage(folder_.path());
  EXPECT_EQ(take(false), 0);
  outage.reset();
  EXPECT_EQ(take(false), kWalls);
  EXPECT_EQ(take(false), 0);
}

TEST_F(LostCubes, AreNotHandedOutAsEmpty) {
  ASSERT_NO_FATAL_FAILURE(touch());
  EXPECT_EQ(take(true), kWalls);
  ASSERT_NO_FATAL_FAILURE(touch());
  overwritePages(folder_.path());
  table_.at(cubeOfWall(0) - Vec3i{1, 0, 0}).surface = wall();  // in a sector that was lost
  table_.close();
  EXPECT_EQ(take(false), 1) << "only what came since";
  EXPECT_EQ(table_.takeLost().size(), 1u);
}

/// Blocks know where their surfaces are.
TEST_F(LostCubes, GetTheirSurfacesBack) {
  constexpr int32_t kCellLog2 = 0;
  SurfaceCells surfaces(kCellLog2, 1);
  BlockMesh mesh;
  mesh.key = {0, 0, 0};
  for (const Vec3f at :
       {Vec3f{1.5f, 1.5f, 1.5f}, Vec3f{5.5f, 1.5f, 1.5f}, Vec3f{1.5f, 5.5f, 1.5f}}) {
    mesh.vertices.emplace_back();
    mesh.vertices.back().position = at;
  }
  mesh.triangles = {0, 1, 2};
  const std::vector<Vec3i> cubes = surfaces.apply({mesh}, table_);
  ASSERT_FALSE(cubes.empty());
  const CellMask before = table_.find(cubes[0]).surface;
  ASSERT_FALSE(isEmpty(before));
  waitUntilWritten();
  overwritePages(folder_.path());
  add(table_.at(cubes[0]).free, 0);
  table_.close();
  EXPECT_EQ(surfaces.restoreLost(table_.takeLost(), table_).size(), cubes.size());
  EXPECT_TRUE(
      std::equal(before.word, before.word + kWordsPerCube, table_.find(cubes[0]).surface.word));
}

}  // namespace
}  // namespace dtsdf
