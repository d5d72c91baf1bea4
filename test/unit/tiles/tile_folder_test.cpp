// What lies in the folder of a plan: its tiles' locks and tables, and plans that are none.
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <system_error>

#include "dtsdf_mapping/io/map_file.h"
#include "kernels/core/grid.h"
#include "support/temporary_folder.h"
#include "tiles/join_tables.h"
#include "tiles/tile_folder.h"

namespace {

std::atomic<int> flock_error{0};  ///< What flock() fails with below; 0: it is that of the system.

}  // namespace

/// Stands before that of the C library: some file systems have no locks.
extern "C" int flock(int descriptor, int operation) noexcept {
  if (flock_error == 0) return static_cast<int>(syscall(SYS_flock, descriptor, operation));
  errno = flock_error;
  return -1;
}

namespace dtsdf {
namespace {

TEST(TileLock, IsHeldByOne) {
  const TemporaryFolder folder;
  const std::string plan = folder.path();
  {
    const TileLock lock(plan, 3);
    EXPECT_EQ(stateOf(plan, 3, "").stage, TileStage::kRunning);
    const std::string error = errorOf([&] { const TileLock second(plan, 3); });
    EXPECT_NE(error.find("being made by another process"), std::string::npos) << error;
  }
  EXPECT_EQ(stateOf(plan, 3, "").stage, TileStage::kWaiting);
  EXPECT_EQ(errorOf([&] { const TileLock again(plan, 3); }), "");
}

TEST(TileLock, TellsOfFileSystemsWithoutLocks) {
  const TemporaryFolder folder;
  const std::string plan = folder.path();
  { const TileLock lock(plan, 3); }
  for (const int reason : {ENOSYS, ENOLCK, EOPNOTSUPP}) {
    flock_error = reason;
    const std::string error = errorOf([&] { const TileLock lock(plan, 3); });
    const TileStage stage = stateOf(plan, 3, "").stage;
    flock_error = 0;
    EXPECT_NE(error.find("cannot lock '" + tilePath(plan, 3, ".lock") +
                         "': " + std::generic_category().message(reason)),
              std::string::npos)
        << error;
    EXPECT_NE(error.find("file system with locks"), std::string::npos) << error;
    EXPECT_EQ(stage, TileStage::kWaiting) << "nobody works on it";
  }
}

TEST(PlanFile, WithoutTilesIsNone) {
  const TemporaryFolder folder;
  Plan plan;
  plan.tiles.emplace_back();
  savePlan(plan, folder.path());
  EXPECT_EQ(loadPlan(folder.path()).plan.tiles.size(), 1u);
  EXPECT_EQ(readTileNumber("0", plan), 0u);
  plan.tiles.clear();
  savePlan(plan, folder.path());
  const std::string error = errorOf([&] { loadPlan(folder.path()); });
  EXPECT_NE(error.find("it has no tiles"), std::string::npos) << error;
  EXPECT_NE(error.find("tiles plan"), std::string::npos) << error;
}

/// A map of blocks and cubes side by side, with nothing in their voxels.
MapContents rowOf(int first, int blocks, int cubes) {
  MapContents contents;
  contents.settings = {{"map/voxel_size_m", 0.02},
                       {"map/truncation_voxels", 4.0},
                       {"map/directional", true},
                       {"fusion/mode", std::string("ray_casting")}};
  contents.cell_voxels = 8;
  for (int i = 0; i < blocks; ++i) contents.blocks.push_back({{first + i, 0, 0}, 1, 0});
  for (int i = 0; i < cubes; ++i) contents.free_cubes.push_back({{first / 8 + i, 0, 0}, {1}});
  contents.voxels = PlainArray<uint64_t>(static_cast<size_t>(blocks) * kVoxelsPerBlock);
  std::fill_n(contents.voxels.data(), contents.voxels.size(), 0);
  return contents;
}

TEST(JoinedTables, TakeNoMoreThanTheyHold) {
  constexpr int kBlocks[] = {300, 0, 77, 500}, kCubes[] = {20, 1, 0, 60};
  const TemporaryFolder folder;
  LoadedPlan loaded;
  for (int i = 0; i < 4; ++i) {
    const int first = 800 * (3 - i);  // the order of keys is not that of tiles
    loaded.plan.tiles.emplace_back();
    loaded.plan.tiles.back().own = {{first, 0, 0}, {first + 799, 0, 0}};
    const SavedMap saved =
        saveMap(rowOf(first, kBlocks[i], kCubes[i]), tilePath(folder.path(), i, ".dtsdf"));
    TileRecord record;
    record.content_hash = saved.content_hash;
    record.blocks = saved.size.blocks;
    record.free_cubes = saved.size.free_cubes;
    saveRecord(record, folder.path(), i);
  }
  const JoinedTable table = joinTables(folder.path(), loaded);
  EXPECT_EQ(table.head.blocks.size(), 877u);
  EXPECT_EQ(table.head.free_cubes.size(), 81u);
  EXPECT_EQ(sizeOf(table.head).blocks, 877u) << "in the order of their keys";
  EXPECT_EQ(table.tile_of.front(), 3u);
  EXPECT_EQ(table.tile_of.back(), 0u);
  EXPECT_EQ(table.head.blocks.capacity(), table.head.blocks.size());
  EXPECT_EQ(table.head.free_cubes.capacity(), table.head.free_cubes.size());
  EXPECT_EQ(table.tile_of.capacity(), table.tile_of.size());
  TileRecord other = loadRecord(folder.path(), 2);
  ++other.free_cubes;
  saveRecord(other, folder.path(), 2);
  const std::string error = errorOf([&] { joinTables(folder.path(), loaded); });
  EXPECT_NE(error.find("tile 2 cannot be merged: its map file does not match its record"),
            std::string::npos)
      << error;
}

}  // namespace
}  // namespace dtsdf
