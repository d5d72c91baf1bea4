// Tests that cells that cannot be read from disk are unknown, and that distances are then never too
// large.
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

/// Each wall lies in its own sector, next to the border to the following sector.
Vec3i cubeOfWall(int i) { return {8 * i + 3, 0, 0}; }
CellMask wall() {
  CellMask mask{};
  for (int z = 0; z < kCubeSide; ++z) {
    for (int y = 0; y < kCubeSide; ++y) add(mask, cellIndex(7, y, z));
  }
  return mask;
}
/// A cell three cells in front of a wall.
Vec3i cellBefore(int i) { return firstCellOfCube(cubeOfWall(i)) + Vec3i{4, 4, 4}; }

/// A surface cell behind a wall, in the next sector but within the maximum distance.
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
    ASSERT_LE(pages_->bytes(), 1u) << "all sectors should be on disk";
  }
};

class LostSurfaces : public LostCells {
 protected:
  CellTable table_{pages_};
  DistanceField field_{kReach, 2, pages_};

  void put(const Vec3i& cube, const CellMask& surface) {
    table_.at(cube).surface = surface;
    field_.noteChange(cube);
  }
  void update() {
    table_.close();
    field_.update(table_.all());
  }
  void build() {
    for (int i = 0; i < kWalls; ++i) put(cubeOfWall(i), wall());
    update();
    for (int i = 0; i < kWalls; ++i) ASSERT_EQ(squaredAt(field_.sectors(), cellBefore(i)), 9);
    waitUntilWritten();
  }
  void updateBehind() {
    for (int i = 0; i < kWalls; ++i) put(cubeBehind(i).key, cubeBehind(i).cells);
    update();
  }
  void expectSafe() const {
    for (int i = 0; i < kWalls; ++i) {
      const int squared = squaredAt(field_.sectors(), cellBefore(i));
      ASSERT_GE(squared, 0) << i;
      ASSERT_LE(squared, 9) << i;
    }
  }
};

TEST_F(LostSurfaces, StillLimitDistances) {
  ASSERT_NO_FATAL_FAILURE(build());
  overwritePages(folder_.path());
  updateBehind();
  ASSERT_NO_FATAL_FAILURE(expectSafe());
  for (int i = 0; i < kWalls; ++i) put(cubeOfSector(sectorOfCube(cubeOfWall(i)), 0), wall());
  update();
  ASSERT_NO_FATAL_FAILURE(expectSafe());
}

TEST_F(LostSurfaces, StillLimitDistancesDuringAnOutage) {
  ASSERT_NO_FATAL_FAILURE(build());
  CellMask moved{};
  add(moved, cellIndex(5, 4, 4));
  {
    const DiskOutage outage(folder_.path());
    updateBehind();
    ASSERT_NO_FATAL_FAILURE(expectSafe());
    for (int i = 0; i < kWalls; ++i) put(cubeOfWall(i), moved);
    update();
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
  /// Checks that all returned cubes are walls. @return The number of cubes.
  int take(bool all) {
    const SpaceChanges taken = table_.takeTouched(all, 1000);
    for (const SpaceCube& cube : taken.cubes) {
      EXPECT_TRUE(std::equal(cube.surface.begin(), cube.surface.end(), wall().word));
    }
    EXPECT_FALSE(taken.is_part);
    return static_cast<int>(taken.cubes.size());
  }
};

TEST_F(LostCubes, ArePublishedOnceReadable) {
  ASSERT_NO_FATAL_FAILURE(touch());
  EXPECT_EQ(take(true), kWalls);
  ASSERT_NO_FATAL_FAILURE(touch());
  std::optional<DiskOutage> outage(folder_.path());
  EXPECT_EQ(take(false), 0);
  outage.reset();
  EXPECT_EQ(take(false), kWalls);
  EXPECT_EQ(take(false), 0);
}

TEST_F(LostCubes, AreUnknown) {
  ASSERT_NO_FATAL_FAILURE(touch());
  overwritePages(folder_.path());
  const Vec3i beside = cubeOfWall(0) - Vec3i{1, 0, 0};  // in a lost sector
  table_.at(beside).surface = wall();
  table_.close();
  EXPECT_TRUE(isEmpty(table_.find(cubeOfWall(0))));
  EXPECT_FALSE(isEmpty(table_.find(beside))) << "a cell added after the loss should be known";
}

/// Blocks in two sectors may each have a triangle in the same cell. The cell must stay when one
/// block removes its triangle, even if the cell list of the other block is lost.
class LostLists : public LostCells {
 protected:
  const Vec3i cell_{32, 1, 1};
  CellTable table_;
  SurfaceCells surfaces_{0, 1, pages_};

  void SetUp() override { put(3, 8.5f); }  // outside the block

  void put(int32_t x, float at) {
    BlockMesh mesh;
    mesh.key = {x, 0, 0};
    for (const float aside : {0.1f, 0.2f, 0.3f}) {
      mesh.vertices.emplace_back();
      mesh.vertices.back().position = {at + aside, 1.5f, 1.5f};
    }
    mesh.triangles = {0, 1, 2};
    surfaces_.apply({mesh}, table_);
  }
  void putEmpty(int32_t x) {
    BlockMesh mesh;
    mesh.key = {x, 0, 0};
    surfaces_.apply({mesh}, table_);
  }
  bool isThere() const { return isIn(table_.find(cubeOfCell(cell_)).surface, indexInCube(cell_)); }
};

TEST_F(LostLists, KeepSurfacesDuringAnOutage) {
  waitUntilWritten();
  {
    const DiskOutage outage(folder_.path());
    put(4, 0.5f);
    putEmpty(4);
    EXPECT_TRUE(isThere());
  }
  put(4, 0.5f);
  putEmpty(4);
  EXPECT_TRUE(isThere());
  putEmpty(3);
  EXPECT_FALSE(isThere()) << "the cell should be removed if nothing is lost";
}

TEST_F(LostLists, KeepSurfaces) {
  waitUntilWritten();
  overwritePages(folder_.path());
  put(3, 0.5f);
  put(4, 0.5f);
  putEmpty(4);
  EXPECT_TRUE(isThere());
}

}  // namespace
}  // namespace dtsdf
