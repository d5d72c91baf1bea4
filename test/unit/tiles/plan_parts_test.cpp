// The parts of plans: ranges of images, what a view passes through, the cut, the queue, the job.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <random>
#include <set>
#include <sstream>

#include "kernels/core/grid.h"
#include "map/block_table.h"
#include "support/temporary_folder.h"
#include "tiles/index_ranges.h"
#include "tiles/make_tiles.h"
#include "tiles/pinhole_view.h"
#include "tiles/slurm.h"
#include "tiles/tile_queue.h"
#include "tiles/view_reach.h"

namespace dtsdf {
namespace {

TEST(IndexRanges, HoldWhatWasAdded) {
  std::mt19937 random(7);
  std::set<size_t> expected;
  IndexRanges ranges;
  size_t index = 0;
  for (int i = 0; i < 500; ++i) {
    index += random() % 3;
    expected.insert(index);
    ranges.add(index);
  }
  EXPECT_EQ(ranges.list(), std::vector<size_t>(expected.begin(), expected.end()));
  EXPECT_EQ(ranges.count(), expected.size());
  for (size_t i = 0; i < index + 3; ++i) EXPECT_EQ(ranges.contains(i), expected.count(i) > 0) << i;
  EXPECT_EQ(IndexRanges(ranges.ranges()).list(), ranges.list());
  EXPECT_ANY_THROW(IndexRanges({{5, 3}}));
  EXPECT_ANY_THROW(IndexRanges({{1, 3}, {3, 4}}));
}

/// Depths of a wall with holes in it, and beyond the range in parts.
struct RandomView {
  explicit RandomView(std::mt19937& random) : depth(kWidth * kHeight, 0) {
    std::uniform_int_distribution<int> far(500, 15000);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        if ((u / 20 + v / 20) % 3 != 0) depth[v * kWidth + u] = static_cast<uint16_t>(far(random));
      }
    }
    frame.data = depth.data();
    frame.row_bytes = kWidth * sizeof(uint16_t);
    frame.width = kWidth;
    frame.height = kHeight;
    frame.intrinsics = {90.0f, 95.0f, 61.3f, 40.1f};
    frame.T_W_C = Eigen::Translation3d(0.3, -2.0, 1.0) *
                  Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, 0.9, -0.2).normalized());
  }

  static constexpr int kWidth = 120, kHeight = 90;
  std::vector<uint16_t> depth;
  DepthFrame frame;
};

TEST(ViewReach, PassesThroughEveryBoxOnARay) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0.0, 1.0), size(0.02, 3.0);
  for (int round = 0; round < 5; ++round) {
    const RandomView view(random);
    const ViewReach reach(view.frame, MapperParams());
    for (int i = 0; i < 4000; ++i) {
      const int u = static_cast<int>(random() % RandomView::kWidth);
      const int v = static_cast<int>(random() % RandomView::kHeight);
      const double z_m = 0.001 * view.depth[v * RandomView::kWidth + u] * share(random);
      if (z_m == 0.0) continue;
      const Intrinsics& K = view.frame.intrinsics;
      const Eigen::Vector3d p_C((u - K.cx) * z_m / K.fx, (v - K.cy) * z_m / K.fy, z_m);
      const Eigen::Vector3d p_W = view.frame.T_W_C * p_C;
      const Eigen::Vector3d below(size(random), size(random), size(random));
      const Eigen::Vector3d above(size(random), size(random), size(random));
      EXPECT_TRUE(reach.mayPass({p_W - below, p_W + above}));
    }
  }
}

TEST(ViewReach, LeavesOutWhatIsBehindTheCameraBesideTheImageOrTooFar) {
  std::mt19937 random(3);
  const RandomView view(random);
  const ViewReach reach(view.frame, MapperParams());
  const auto boxAt = [&](double x, double y, double z) {
    const Eigen::Vector3d p_W = view.frame.T_W_C * Eigen::Vector3d(x, y, z);
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.2);
    return MetricBox{p_W - half, p_W + half};
  };
  EXPECT_TRUE(reach.mayPass(boxAt(0.0, 0.0, 0.1)));
  EXPECT_FALSE(reach.mayPass(boxAt(0.0, 0.0, -1.0)));
  EXPECT_FALSE(reach.mayPass(boxAt(0.0, 0.0, 17.0)));
  EXPECT_FALSE(reach.mayPass(boxAt(4.0, 0.0, 2.0)));
  EXPECT_FALSE(reach.mayPass(boxAt(0.0, -4.0, 2.0)));
  // Beside the camera, and in part behind it.
  EXPECT_TRUE(reach.mayPass(boxAt(0.0, 0.1, 0.0)));
  for (const auto& [x, y] : {std::pair{5.0, 0.0}, {-5.0, 0.0}, {0.0, 5.0}, {0.0, -5.0}}) {
    EXPECT_FALSE(reach.mayPass(boxAt(x, y, 0.0)));
  }
}

TEST(IndexRanges, UniteToWhatIsInAny) {
  std::mt19937 random(5);
  std::vector<IndexRanges> parts(4);
  std::set<size_t> expected;
  for (IndexRanges& part : parts) {
    for (size_t index = random() % 9; index < 200; index += 1 + random() % 9) {
      part.add(index);
      expected.insert(index);
    }
  }
  parts.emplace_back();
  std::vector<const IndexRanges*> listed;
  for (const IndexRanges& part : parts) listed.push_back(&part);
  const IndexRanges united = IndexRanges::unite(listed);
  EXPECT_EQ(united.list(), std::vector<size_t>(expected.begin(), expected.end()));
  EXPECT_EQ(IndexRanges(united.ranges()).count(), expected.size());
}

/// The tile of some blocks of a map, of three directions each.
Tile tileOf(const std::set<PackedKey>& keys, const BlockExtent& own) {
  Tile tile;
  tile.own = own;
  tile.fused = withHalo(own);
  for (const PackedKey key : keys) {
    tile.estimate.own_blocks += own.contains(unpackKey(key));
    tile.estimate.blocks += tile.fused.contains(unpackKey(key));
  }
  tile.estimate.map_bytes =
      tile.estimate.blocks * (BlockTable::kBlockBytes + 3 * BlockTable::kArrayBytes);
  return tile;
}

TEST(CutToBudget, CutsUntilAllPartsFitAndLosesNothing) {
  std::mt19937 random(11);
  std::set<PackedKey> keys;
  for (int i = 0; i < 600; ++i) {
    keys.insert(packKey({static_cast<int>(random() % 20), static_cast<int>(random() % 9), 0}));
  }
  const BlockExtent whole{{0, 0, -10}, {19, 8, 9}};
  const size_t budget = 60 * (BlockTable::kBlockBytes + 3 * BlockTable::kArrayBytes);
  const auto describe = [&](const BlockExtent& own) { return tileOf(keys, own); };
  const std::vector<Tile> parts = cutToBudget(whole, {budget, 0}, describe);
  EXPECT_GT(parts.size(), 3u);
  for (const PackedKey key : keys) {
    int owners = 0;
    for (const Tile& part : parts) owners += part.own.contains(unpackKey(key));
    EXPECT_EQ(owners, 1);
  }
  for (const Tile& part : parts) {
    EXPECT_LE(part.estimate.map_bytes, budget);
    EXPECT_GT(part.estimate.own_blocks, 0u);
  }
  EXPECT_EQ(cutToBudget(whole, {size_t{1} << 40, 0}, describe).size(), 1u);
  EXPECT_ANY_THROW(cutToBudget(whole, {BlockTable::kArrayBytes, 0}, describe));
}

TEST(CutToBudget, CutsWhereThereIsTooMuchFreeSpace) {
  // A byte for each cube, and no blocks.
  const auto describe = [&](const BlockExtent& own) {
    Tile tile;
    tile.own = own;
    const BlockExtent cubes = cubesOf(own, 4);
    tile.estimate.free_bytes = 1;
    for (const int edge : {cubes.last.x - cubes.first.x, cubes.last.y - cubes.first.y,
                           cubes.last.z - cubes.first.z}) {
      tile.estimate.free_bytes *= static_cast<size_t>(std::max(edge + 1, 0));
    }
    return tile;
  };
  const BlockExtent whole{{-3, 0, 0}, {36, 39, 39}};
  EXPECT_EQ(cutToBudget(whole, {0, 1000}, describe).size(), 1u) << "10 x 10 x 10";
  size_t cubes = 0;
  for (const Tile& part : cutToBudget(whole, {0, 200}, describe)) {
    EXPECT_LE(part.estimate.free_bytes, 200u);
    cubes += part.estimate.free_bytes;
  }
  EXPECT_EQ(cubes, 1000u) << "each in one part";
}

TEST(CubesOfTiles, AreEachOneTiles) {
  for (const int cell_voxels : {1, 2, 4, 8}) {
    const int n = blocksPerCube(cell_voxels);
    EXPECT_EQ(n, cell_voxels) << "8 cells an edge, and 8 voxels";
    for (const int edge : {1, 3, 4, 7}) {
      for (int cube = -9; cube <= 9; ++cube) {
        const int tile = floorDivided(cube * n, edge);
        for (int t = tile - 3; t <= tile + 3; ++t) {
          const BlockExtent own{{t * edge, 0, 0}, {t * edge + edge - 1, 0, 0}};
          EXPECT_EQ(cubesOf(own, cell_voxels).contains({cube, 0, 0}), t == tile);
        }
      }
    }
  }
}

// Whatever is seen in a part of an image, up to a depth, lies in its bounds.
TEST(PinholeView, BoundsHoldWhatIsInView) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const RandomView depth(random);
  const PinholeView view(depth.frame);
  const PixelRect rect{20.0, 30.0, 80.0, 85.0};
  const MetricBox box = view.boundsUpTo(3.0, rect);
  const Intrinsics& K = depth.frame.intrinsics;
  MetricBox seen;
  for (int i = 0; i < 20000; ++i) {
    const double z_m = 3.0 * share(random);
    const double u = rect.left + (rect.right - rect.left) * share(random) - 0.5;
    const double v = rect.top + (rect.bottom - rect.top) * share(random) - 0.5;
    const Eigen::Vector3d p_C((u - K.cx) / K.fx * z_m, (v - K.cy) / K.fy * z_m, z_m);
    seen.extend(depth.frame.T_W_C * p_C);
  }
  const Eigen::Vector3d rounding = Eigen::Vector3d::Constant(1e-9);
  EXPECT_TRUE(MetricBox(box.min() - rounding, box.max() + rounding).contains(seen));
  EXPECT_TRUE((box.sizes().array() < 1.3 * seen.sizes().array()).all()) << "no wider";
}

Plan planOf(const std::vector<double>& seconds) {
  Plan plan;
  for (const double expected : seconds) {
    plan.tiles.emplace_back();
    plan.tiles.back().estimate.seconds = expected;
  }
  return plan;
}

TEST(TileQueue, GivesTheLongestFirstAndTriesTwice) {
  const Plan plan = planOf({1.0, 4.0, 2.0, 3.0});
  TileQueue queue(plan, {false, false, true, false});
  EXPECT_EQ(queue.next(), 1u);
  EXPECT_EQ(queue.next(), 3u);
  EXPECT_FALSE(queue.secondsLeft(1.0));
  EXPECT_FALSE(queue.finish(3, true));
  EXPECT_DOUBLE_EQ(*queue.secondsLeft(6.0), 10.0) << "3 of 8 took 6 s";
  EXPECT_TRUE(queue.finish(1, false)) << "once more";
  EXPECT_EQ(queue.next(), 0u);
  EXPECT_EQ(queue.next(), 1u);
  EXPECT_FALSE(queue.next());
  EXPECT_FALSE(queue.isOver());
  queue.finish(0, true);
  EXPECT_FALSE(queue.finish(1, false));
  EXPECT_TRUE(queue.isOver());
  EXPECT_EQ(queue.failed(), std::vector<size_t>{1});
  EXPECT_EQ(queue.doneCount(), 3u);
  EXPECT_EQ(queue.attempts(1), 2u);
}

/// The numbers of the tiles that a task of a job makes, as a shell runs its script.
std::string tilesOfTask(const std::string& script, int task) {
  const TemporaryFolder folder;
  writeBytes(folder / "job.sh", script);
  const std::string command = "SLURM_ARRAY_TASK_ID=" + std::to_string(task) + " bash " +
                              (folder / "job.sh") + " > " + (folder / "out");
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::istringstream out(readBytes(folder / "out"));
  std::string tiles, fuse, name, tile, rest;
  while (out >> fuse >> name >> tile && std::getline(out, rest)) {
    EXPECT_EQ(fuse, "fuse");
    EXPECT_EQ(name, "/a'b");
    EXPECT_EQ(rest, " --threads 3");
    tiles += tile + " ";
  }
  return tiles;
}

TEST(SlurmScript, TasksMakeEveryTileOnce) {
  const Plan plan = planOf(std::vector<double>(2300, 1.0));
  SlurmRequest request;
  request.folder = "/a'b";
  request.program = "echo";
  request.threads = 3;
  const std::string script = slurmScript(request, plan);
  EXPECT_NE(script.find("#SBATCH --array=0-999\n"), std::string::npos);
  EXPECT_EQ(tilesOfTask(script, 0), "0 1000 2000 ");
  EXPECT_EQ(tilesOfTask(script, 299), "299 1299 2299 ");
  EXPECT_EQ(tilesOfTask(script, 300), "300 1300 ");
  EXPECT_EQ(tilesOfTask(script, 999), "999 1999 ");
}

TEST(SlurmScript, WritesLogsBesideTheTilesWhateverTheFolderIsCalled) {
  SlurmRequest request;
  request.folder = "/my map/50% \"new\"";
  EXPECT_NE(slurmScript(request, planOf({1.0}))
                .find("#SBATCH --output=\"/my map/50%% \\\"new\\\"/tiles/slurm-%A_%a.log\"\n"),
            std::string::npos);
  for (const char* const name : {"/a\\b", "/a\nb"}) {
    request.folder = name;
    const std::string error = errorOf([&] { slurmScript(request, planOf({1.0})); });
    EXPECT_NE(error.find("give the folder another name"), std::string::npos) << error;
  }
}

TEST(SlurmScript, AsksForAGpuForCudaOnly) {
  const auto scriptWith = [](const std::optional<std::string>& backend) {
    SlurmRequest request;
    request.folder = "/a";
    request.program = "echo";
    request.backend = backend;
    return slurmScript(request, planOf({1.0}));
  };
  const std::string gpu = "#SBATCH --gres=gpu:1\n";
  EXPECT_NE(scriptWith("cuda").find(gpu), std::string::npos);
  EXPECT_NE(scriptWith("cuda").find(" --backend 'cuda'"), std::string::npos);
  EXPECT_EQ(scriptWith("cpu").find(gpu), std::string::npos);
  EXPECT_EQ(scriptWith("auto").find(gpu), std::string::npos);
  EXPECT_EQ(scriptWith(std::nullopt).find(gpu), std::string::npos);
  EXPECT_EQ(scriptWith(std::nullopt).find("--backend"), std::string::npos);
}

}  // namespace
}  // namespace dtsdf
