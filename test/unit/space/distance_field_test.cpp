// Compares distances to the nearest surface cell with the minimum over all surface cells.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <stdexcept>
#include <utility>

#include "space/distance_field.h"
#include "support/random_seed.h"

namespace dtsdf {
namespace {

bool isBefore(const Vec3i& a, const Vec3i& b) { return packKey(a) < packKey(b); }

/// Keeps the surface cells both in a list and in a table.
class Surfaces {
 public:
  void put(const Vec3i& cell) {
    if (!isThere(cell)) sites_.push_back(cell);
    add(maskAt(cell), indexInCube(cell));
  }
  void take(size_t i) {
    const Vec3i cell = sites_[i];
    sites_.erase(sites_.begin() + static_cast<std::ptrdiff_t>(i));
    remove(maskAt(cell), indexInCube(cell));
  }
  void changeSome(std::mt19937& random, int round);
  bool isThere(const Vec3i& cell) const {
    return std::find(sites_.begin(), sites_.end(), cell) != sites_.end();
  }

  void updateAll(DistanceField& field) {
    table_.close();
    for (const PackedKey key : changed_) field.noteChange(unpackKey(key));
    field.update(table_.all());
    changed_.clear();
  }

  const CellSectors& cells() const { return table_.all(); }
  int squaredDistance(const Vec3i& cell, int reach) const {
    int least = reach * reach + 1;
    for (const Vec3i& site : sites_) {
      const Vec3i d = site - cell;
      least = std::min(least, d.x * d.x + d.y * d.y + d.z * d.z);
    }
    return least > reach * reach ? -1 : least;
  }

 private:
  CellMask& maskAt(const Vec3i& cell) {
    const Vec3i cube = cubeOfCell(cell);
    changed_.insert(packKey(cube));
    return table_.open(packKey(sectorOfCube(cube))).make(cubeInSector(cube)).surface;
  }

  SectorTable<CellSector> table_{nullptr};
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

/// Adds surface cells. In every third round, most of them are then removed.
void Surfaces::changeSome(std::mt19937& random, int round) {
  for (const Vec3i& cell : someCells(random, 6, 40)) put(cell);
  while (round % 3 == 2 && sites_.size() > 5) take(random() % sites_.size());
}

TEST(DistanceField, IsExactAfterEveryChange) {
  std::mt19937 random(caseSeed(0));
  for (const int reach : {1, 7, 25, 130}) {
    Surfaces surfaces;
    DistanceField field(reach, 2);
    for (int round = 0; round < (reach > 100 ? 3 : 12); ++round) {
      surfaces.changeSome(random, round);
      surfaces.updateAll(field);
      for (const Vec3i& cell : someCells(random, 400, 50 + std::max(25, reach / 2))) {
        ASSERT_EQ(squaredAt(field.sectors(), cell), surfaces.squaredDistance(cell, reach))
            << "maximum distance " << reach << ", round " << round << ", cell " << cell.x << " "
            << cell.y << " " << cell.z;
      }
    }
  }
}

/// The squared distance of a cell, computed as the minimum over all rows within the maximum
/// distance.
uint16_t rowMinimum(const DistanceTask& task, const SectorStack& stack, const Vec3i& cell) {
  int32_t least = kSquaredFar;
  std::vector<uint32_t> words(static_cast<size_t>(windowSide(task.reach)));
  for (int32_t z = -task.reach; z <= task.reach; ++z) {
    for (int32_t y = -task.reach; y <= task.reach; ++y) {
      for (size_t i = 0; i < words.size(); ++i) {
        words[i] = surfacesInRow(task, stack, static_cast<int32_t>(i), cell.y + y, cell.z + z);
      }
      least = std::min(least, y * y + z * z + squaredAlongRow(words.data(), cell.x, task.reach));
    }
  }
  return squaredWithin(least, task.reach);
}

constexpr uint16_t kNotAsked = 0xfffe;

/// Computes the distance of every step-th cell in each sector. A GPU would compute all cells.
void computeSome(const DistanceTask& task, std::vector<SectorSquares>& squares, int step) {
  for (int32_t i = 0; i < task.stack_count; ++i) {
    const SectorStack& stack = task.stacks[i];
    for (int32_t k = 0; k < stack.count; ++k) {
      SectorSquares& sector = squares[static_cast<size_t>(stack.first + k)];
      sector = SectorSquares(new uint16_t[kCellsPerSector]);
      std::fill_n(sector.get(), kCellsPerSector, kNotAsked);
      for (int cell = step / 2; cell < kCellsPerSector; cell += step) {
        const Vec3i cube = firstCellOfCube(cubeOfSector({0, 0, k}, cell / kCellsPerCube));
        sector[cell] = rowMinimum(task, stack, cube + voxelOffset(cell % kCellsPerCube));
      }
    }
  }
}

/// The test's backend declines some tasks if the maximum distance is 1. The host then computes the
/// distances.
TEST(DistanceField, UsesABackend) {
  std::mt19937 random(caseSeed(0));
  for (const auto& [reach, step] : {std::pair{1, 1}, {32, 7001}, {33, 7001}, {130, 30011}}) {
    SCOPED_TRACE(reach);
    Surfaces surfaces;
    DistanceField field(reach, 1);
    int calls = 0;
    field.setBackend(
        [&, every = step](const DistanceTask& task, std::vector<SectorSquares>& squares) {
          if (every == 1 && ++calls % 3 == 2) return false;
          computeSome(task, squares, every);
          return true;
        });
    size_t asked = 0;
    for (int round = 0; round < 2; ++round) {
      surfaces.changeSome(random, round);
      surfaces.updateAll(field);
      for (const auto& [key, paged] : field.sectors()) {
        const auto sector = paged.get();
        for (int i = step / 2; i < kCellsPerSector; i += std::max(step, 101)) {
          ASSERT_NE(sector->squared[i], kNotAsked);
          const Vec3i cube = firstCellOfCube(cubeOfSector(unpackKey(key), i / kCellsPerCube));
          const Vec3i cell = cube + voxelOffset(i % kCellsPerCube);
          ASSERT_EQ(sector->squaredAt(cell), surfaces.squaredDistance(cell, reach));
          ++asked;
        }
      }
    }
    EXPECT_GT(asked, 500u);
  }
}

/// If an update fails, for example because the device was lost, the next update also computes the
/// distances that the failed update did not.
TEST(DistanceField, TheNextUpdateCompletesAFailedOne) {
  DistanceField field(25, 1), undisturbed(25, 1);
  bool fails = false;
  field.setBackend([&](const DistanceTask&, std::vector<SectorSquares>&) {
    if (std::exchange(fails, false)) throw std::runtime_error("lost");
    return false;
  });
  Surfaces surfaces;
  for (int i = 0; i < 4; ++i) {
    surfaces.put(firstCellOfCube({5 * i, 0, 1}) + voxelOffset(7 * i));
    Surfaces again = surfaces;
    fails = i % 2 == 1;
    if (fails) {
      EXPECT_THROW(surfaces.updateAll(field), std::runtime_error);
      field.update(surfaces.cells());
    } else {
      surfaces.updateAll(field);
    }
    again.updateAll(undisturbed);
    for (int32_t x = -30; x < 180; ++x) {
      const Vec3i cell{x, 2, 9};
      ASSERT_EQ(squaredAt(field.sectors(), cell), squaredAt(undisturbed.sectors(), cell)) << x;
    }
  }
}

TEST(DistanceField, KeepsNothingWhereSurfacesVanished) {
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
