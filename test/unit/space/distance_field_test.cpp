// Distances between cells, against all pairs.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <unordered_map>

#include "space/distance_field.h"
#include "support/random_seed.h"

namespace dtsdf {
namespace {

bool isBefore(const Vec3i& a, const Vec3i& b) { return packKey(a) < packKey(b); }

/// Cells with surfaces, and a table of them.
class Surfaces {
 public:
  void put(const Vec3i& cell) {
    if (!isThere(cell)) sites_.push_back(cell);
    add(table_[packKey(cubeOfCell(cell))], indexInCube(cell));
    changed_.insert(packKey(cubeOfCell(cell)));
  }
  void take(size_t i) {
    const Vec3i cell = sites_[i];
    sites_.erase(sites_.begin() + static_cast<std::ptrdiff_t>(i));
    remove(table_[packKey(cubeOfCell(cell))], indexInCube(cell));
    changed_.insert(packKey(cubeOfCell(cell)));
  }
  size_t count() const { return sites_.size(); }
  bool isThere(const Vec3i& cell) const {
    return std::find(sites_.begin(), sites_.end(), cell) != sites_.end();
  }

  void updateAll(DistanceField& field) {
    std::vector<SurfaceCube> cubes;
    for (const PackedKey key : changed_) cubes.push_back({unpackKey(key), table_[key]});
    field.update(cubes);
    changed_.clear();
  }

  int squaredDistance(const Vec3i& cell, int reach) const {
    int least = reach * reach + 1;
    for (const Vec3i& site : sites_) {
      const Vec3i d = site - cell;
      least = std::min(least, d.x * d.x + d.y * d.y + d.z * d.z);
    }
    return least > reach * reach ? -1 : least;
  }

 private:
  std::unordered_map<PackedKey, CellMask> table_;
  std::vector<Vec3i> sites_;
  std::set<PackedKey> changed_;
};

std::vector<Vec3i> someCells(std::mt19937& random, int count, int range) {
  std::uniform_int_distribution<int32_t> any(-range, range);
  std::vector<Vec3i> cells;
  for (int i = 0; i < count; ++i) cells.push_back({any(random), any(random), any(random)});
  std::sort(cells.begin(), cells.end(), isBefore);
  return cells;
}

TEST(DistanceField, IsExactAfterEachOfManyChanges) {
  std::mt19937 random(caseSeed(0));
  for (const int reach : {1, 7, 25}) {
    Surfaces surfaces;
    DistanceField field(reach, 2);
    for (int round = 0; round < 12; ++round) {
      for (const Vec3i& cell : someCells(random, 6, 40)) surfaces.put(cell);
      while (round % 3 == 2 && surfaces.count() > 5) surfaces.take(random() % surfaces.count());
      surfaces.updateAll(field);
      for (const Vec3i& cell : someCells(random, 400, 75)) {
        ASSERT_EQ(squaredAt(field.sectors(), cell), surfaces.squaredDistance(cell, reach))
            << "reach " << reach << ", round " << round << ", cell " << cell.x << " " << cell.y
            << " " << cell.z;
      }
    }
  }
}

/// Squares that do not fit into 16 bits with a sign while they are added up.
TEST(DistanceField, ReachesFar) {
  constexpr int kReach = 130;
  Surfaces surfaces;
  DistanceField field(kReach, 2);
  surfaces.put({3, -4, 12});
  surfaces.updateAll(field);
  surfaces.put({20, 9, -31});
  surfaces.updateAll(field);
  std::mt19937 random(caseSeed(0));
  for (const Vec3i& cell : someCells(random, 400, 110)) {
    ASSERT_EQ(squaredAt(field.sectors(), cell), surfaces.squaredDistance(cell, kReach));
  }
}

TEST(DistanceField, NothingIsKeptWhereSurfacesHaveGone) {
  Surfaces surfaces;
  DistanceField field(10, 1);
  EXPECT_EQ(squaredAt(field.sectors(), {0, 0, 0}), -1);
  surfaces.put({3, -4, 12});
  surfaces.updateAll(field);
  EXPECT_EQ(squaredAt(field.sectors(), {3, -4, 12}), 0);
  EXPECT_EQ(squaredAt(field.sectors(), {3, -4, 22}), 100);
  EXPECT_EQ(squaredAt(field.sectors(), {3, -4, 23}), -1);
  surfaces.take(0);
  surfaces.updateAll(field);
  EXPECT_EQ(squaredAt(field.sectors(), {3, -4, 12}), -1);
  EXPECT_EQ(field.bytes(), 0u);
}

}  // namespace
}  // namespace dtsdf
