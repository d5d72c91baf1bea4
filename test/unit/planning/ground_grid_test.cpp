#include "planning/ground_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <tuple>
#include <utility>

namespace dtsdf {
namespace {

using Pending = GroundGrid::Pending;

constexpr double kCell_m = 0.1;

/// Cells that are set individually, and the cubes that contain them.
class Cells {
 public:
  void set(int x, int y, int z, CellState state) {
    cells_[{x, y, z}] = state;
    SpaceCube& cube = cubes_[{x >> 3, y >> 3, z >> 3}];
    cube.first = {x & ~7, y & ~7, z & ~7};
    const uint64_t bit = uint64_t{1} << ((x & 7) + 8 * (y & 7));
    const auto word = static_cast<size_t>(z & 7);
    cube.free[word] &= ~bit;
    cube.surface[word] &= ~bit;
    if (state == CellState::kFree) cube.free[word] |= bit;
    if (state == CellState::kSurface) cube.surface[word] |= bit;
    changed_[{x >> 3, y >> 3, z >> 3}] = true;
  }

  /// The values of all columns in a box, computed cell by cell.
  std::vector<int8_t> columns(const GridBox& box, int first_z, int last_z) const {
    const auto count = static_cast<size_t>(sizeOf(box).prod());
    std::vector<int> surfaces(count), free(count);
    for (const auto& [key, state] : cells_) {
      const auto [x, y, z] = key;
      if (z < first_z || z > last_z || !box.contains(Eigen::Vector2i(x, y))) continue;
      const auto i = static_cast<size_t>((y - box.min().y()) * sizeOf(box).x() + x - box.min().x());
      if (state == CellState::kSurface) ++surfaces[i];
      if (state == CellState::kFree) ++free[i];
    }
    std::vector<int8_t> values;
    for (size_t i = 0; i < surfaces.size(); ++i) {
      const bool is_half_free = 2 * free[i] >= last_z - first_z + 1;
      values.push_back(static_cast<int8_t>(surfaces[i] > 0 ? 100 : is_half_free ? 0 : -1));
    }
    return values;
  }

  SpaceChanges take() {
    SpaceChanges changes;
    for (const auto& [key, is_changed] : changed_) changes.cubes.push_back(cubes_[key]);
    changed_.clear();
    return changes;
  }

 private:
  using Key = std::tuple<int, int, int>;
  std::map<Key, CellState> cells_;
  std::map<Key, SpaceCube> cubes_;
  std::map<Key, bool> changed_;
};

/// A follower that copies and updates grids like costmap_2d's StaticLayer: updates are placed
/// relative to the corner of the last grid, without checks.
struct GridFollower {
  GridBox window;
  std::vector<int8_t> values;

  void take(const GroundGrid& grid, Pending pending) {
    const GridBox box = pending == Pending::kGrid ? *grid.window() : grid.changed();
    const std::vector<int8_t> sent = grid.values(box);
    if (pending == Pending::kGrid) {
      window = box;
      values = sent;
      return;
    }
    ASSERT_TRUE(window.contains(box));
    size_t next = 0;
    for (int y = box.min().y(); y <= box.max().y(); ++y) {
      for (int x = box.min().x(); x <= box.max().x(); ++x) {
        const int column = x - window.min().x(), row = y - window.min().y();
        values[static_cast<size_t>(row) * static_cast<size_t>(sizeOf(window).x()) +
               static_cast<size_t>(column)] = sent[next++];
      }
    }
  }
};

TEST(GroundGrid, UsesLayersThatOverlapTheHeightRange) {
  // The first and last layers in which a surface makes its column occupied.
  const auto layers = [](double min_m, double max_m, double cell_m) {
    GroundGrid grid(min_m, max_m, 1.0);
    Cells cells;
    for (int z = -20; z < 20; ++z) cells.set(z, 0, z, CellState::kSurface);
    grid.apply(cells.take(), cell_m);
    const std::vector<int8_t> values =
        grid.values({Eigen::Vector2i(-20, 0), Eigen::Vector2i(19, 0)});
    const auto first = std::find(values.begin(), values.end(), kColumnOccupied);
    const auto last = std::find(values.rbegin(), values.rend(), kColumnOccupied);
    return std::make_pair(static_cast<int>(first - values.begin()) - 20,
                          19 - static_cast<int>(last - values.rbegin()));
  };
  EXPECT_EQ(layers(0.15, 0.35, 0.1), std::make_pair(1, 3));
  EXPECT_EQ(layers(0.1, 0.3, 0.1), std::make_pair(1, 2));
  EXPECT_EQ(layers(-0.05, 0.05, 0.1), std::make_pair(-1, 0));
  EXPECT_EQ(layers(0.0, 0.01, 0.1), std::make_pair(0, 0));
  // A cell size computed from a float setting is not exactly 0.08 m.
  const double cell_m = 4.0 * static_cast<double>(0.02f);
  EXPECT_EQ(layers(0.08, 0.8, cell_m), std::make_pair(1, 9));
  EXPECT_EQ(layers(-0.8, -0.08, cell_m), std::make_pair(-10, -2));
}

/// Layers 1 to 3 count. If half of the layers must be free, two free layers are enough and one is
/// not.
TEST(GroundGrid, ColumnsSummariseTheirCells) {
  double share = 0.5;
  const auto valueOf = [&](std::vector<CellState> layers) {
    GroundGrid grid(0.1, 0.4, share);
    Cells cells;
    for (size_t z = 0; z < layers.size(); ++z) cells.set(-3, 5, static_cast<int>(z), layers[z]);
    grid.apply(cells.take(), kCell_m);
    const std::vector<int8_t> values =
        grid.values({Eigen::Vector2i(-3, 5), Eigen::Vector2i(-2, 5)});
    EXPECT_EQ(values[1], kColumnUnknown);
    return values[0];
  };
  const CellState u = CellState::kUnknown, f = CellState::kFree, s = CellState::kSurface;
  EXPECT_EQ(valueOf({u, u, u, u, u}), kColumnUnknown);
  EXPECT_EQ(valueOf({f, f, f, f, f}), kColumnFree);
  EXPECT_EQ(valueOf({u, f, u, f, u}), kColumnFree);
  EXPECT_EQ(valueOf({f, u, u, f, f}), kColumnUnknown);
  EXPECT_EQ(valueOf({s, f, f, f, s}), kColumnFree);
  EXPECT_EQ(valueOf({s, u, u, u, s}), kColumnUnknown);
  EXPECT_EQ(valueOf({u, u, u, s, u}), kColumnOccupied);
  EXPECT_EQ(valueOf({f, s, f, f, f}), kColumnOccupied);
  share = 1.0;
  EXPECT_EQ(valueOf({u, f, f, f, u}), kColumnFree);
  EXPECT_EQ(valueOf({f, u, f, f, f}), kColumnUnknown);
  EXPECT_EQ(valueOf({f, f, f, u, f}), kColumnUnknown);
  share = 0.0;
  EXPECT_EQ(valueOf({u, u, u, u, u}), kColumnUnknown)
      << "a column without a free layer should be unknown";
  EXPECT_EQ(valueOf({u, u, f, u, u}), kColumnFree);
}

/// Cells change at random, near and far. The follower must always have the current values.
TEST(GroundGrid, FollowersHaveTheCurrentValues) {
  std::mt19937 random(7);
  const auto pick = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  GroundGrid grid(-0.35, 0.52, 0.5);  // layers -4 to 5
  Cells cells;
  GridFollower follower;
  size_t grids = 0, updates = 0;
  for (int round = 0; round < 60; ++round) {
    const int x = pick(-round * 12, round * 12), y = pick(-round * 2, round * 8);
    for (int i = 0; i < 400; ++i) {
      cells.set(x + pick(0, 3), y + pick(0, 3), pick(-6, 7),
                static_cast<CellState>(pick(0, 7) < 6 ? 1 : pick(0, 2)));
    }
    grid.apply(cells.take(), kCell_m);
    const Pending pending = grid.next();
    if (pending == Pending::kNothing) continue;
    ASSERT_FALSE(grid.tooLarge());
    ++(pending == Pending::kGrid ? grids : updates);
    follower.take(grid, pending);
    const std::vector<int8_t> expected = cells.columns(follower.window, -4, 5);
    for (size_t i = 0; i < expected.size(); ++i) {
      if (follower.values[i] != expected[i]) FAIL() << "column " << i << " in round " << round;
    }
  }
  EXPECT_GT(grids, 3u);
  EXPECT_GT(updates, 20u);
}

TEST(GroundGrid, ANewCellSizeMakesANewGrid) {
  GroundGrid grid(0.0, 0.4, 1.0);
  Cells cells;
  cells.set(3, 4, 1, CellState::kSurface);
  SpaceChanges changes = cells.take();
  changes.begins_anew = true;
  grid.apply(changes, kCell_m);
  ASSERT_EQ(grid.next(), Pending::kGrid);
  grid.apply(changes, 2.0 * kCell_m);
  EXPECT_EQ(grid.next(), Pending::kGrid);
  EXPECT_EQ(grid.cellSize_m(), 2.0 * kCell_m);
  grid.apply({true, {}}, kCell_m);
  EXPECT_EQ(grid.next(), Pending::kGrid) << "an empty grid should be sent";
}

/// A single remote cell must not make the grid allocate the whole area in between.
TEST(GroundGrid, ReportsGridsThatAreTooLarge) {
  GroundGrid grid(0.0, 0.4, 1.0);
  Cells cells;
  cells.set(0, 0, 1, CellState::kSurface);
  grid.apply(cells.take(), kCell_m);
  ASSERT_EQ(grid.next(), Pending::kGrid);
  cells.set(1 << 22, 1 << 22, 1, CellState::kSurface);
  grid.apply(cells.take(), kCell_m);
  grid.next();
  EXPECT_TRUE(grid.tooLarge());
  EXPECT_EQ(sizeOf(*grid.window()).x(), 256);
  cells.set(7, 7, 1, CellState::kSurface);  // cells within the window are still sent
  grid.apply(cells.take(), kCell_m);
  EXPECT_EQ(grid.next(), Pending::kUpdate);
  EXPECT_TRUE(grid.tooLarge());
  EXPECT_TRUE(grid.changed().contains(Eigen::Vector2i(7, 7)));
  cells.set(1 << 22, 1 << 22, 1, CellState::kUnknown);
  grid.apply(cells.take(), kCell_m);
  cells.set(2, 0, 1, CellState::kSurface);
  grid.apply(cells.take(), kCell_m);
  EXPECT_EQ(grid.next(), Pending::kUpdate);
}

}  // namespace
}  // namespace dtsdf
