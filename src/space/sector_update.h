/// Brings the distances of a sector up to date with surfaces that came and went. One that came can
/// only make distances less, which is done where it does; where one went that some cell was nearest
/// to, the cube of that cell is worked out from the surfaces around.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "space/box_distances.h"
#include "space/distance_sector.h"

namespace dtsdf {

/// With more to do than this the whole sector is worked out again, which takes less time then. By
/// measurement; what comes out is the same.
constexpr int kMostPartsAnew = 16;
constexpr size_t kMostAdded = 192;

template <class Visit>
void visitCells(const CellMask& mask, const Visit& visit) {
  for (int z = 0; z < kWordsPerCube; ++z) {
    for (uint64_t word = mask.word[z]; word != 0; word &= word - 1) {
      const int bit = __builtin_ctzll(word);
      visit(Vec3i{bit % kCubeSide, bit / kCubeSide, z});
    }
  }
}

inline size_t countCells(const CellMask& mask) {
  size_t count = 0;
  for (const uint64_t word : mask.word) count += static_cast<size_t>(__builtin_popcountll(word));
  return count;
}

/// A cube of cells, while single surfaces come and go.
class CubeUpdate {
 public:
  CubeUpdate(uint16_t* squared, uint16_t most, int reach)
      : squared_(squared), bound_(std::min<int32_t>(most, reach * reach + 1)) {}

  /// Whether some cell has no surface nearer than that one; `at` counts from the cube's first cell.
  bool isNearestTo(const Vec3i& at) const {
    bool is_any = false;
    visitRows(at, bound_ + 1, [&](const uint16_t* row, int32_t aside, const int32_t* along) {
      for (int x = 0; x < kCubeSide; ++x) is_any |= row[x] == aside + along[x];
      return !is_any;
    });
    return is_any;
  }

  /// Takes a surface over.
  void lower(const Vec3i& at) const {
    const int32_t bound = bound_;
    visitRows(at, bound, [&](uint16_t* row, int32_t aside, const int32_t* along) {
      for (int x = 0; x < kCubeSide; ++x) {
        const int32_t squared = aside + along[x], known = row[x];
        row[x] = static_cast<uint16_t>(squared < bound && squared < known ? squared : known);
      }
      return true;
    });
  }

 private:
  static int32_t beyond(int32_t at) {
    return at < 0 ? -at : at < kCubeSide ? 0 : at - (kCubeSide - 1);
  }

  /// Those that are nearer to a surface than a bound, until `visit` returns false.
  template <class Visit>
  void visitRows(const Vec3i& at, int32_t bound, const Visit& visit) const {
    const int32_t x_beyond = beyond(at.x), y_beyond = beyond(at.y), z_beyond = beyond(at.z);
    if (x_beyond * x_beyond + y_beyond * y_beyond + z_beyond * z_beyond >= bound) return;
    int32_t along[kCubeSide];
    for (int x = 0; x < kCubeSide; ++x) along[x] = (x - at.x) * (x - at.x);
    for (int z = 0; z < kCubeSide; ++z) {
      for (int y = 0; y < kCubeSide; ++y) {
        const int32_t aside = (y - at.y) * (y - at.y) + (z - at.z) * (z - at.z);
        if (aside + x_beyond * x_beyond >= bound) continue;
        if (!visit(squared_ + cellIndex(0, y, z), aside, along)) return;
      }
    }
  }

  uint16_t* const squared_;
  const int32_t bound_;  ///< Surfaces matter where they are nearer than this.
};

/// Brings sectors up to date, one at a time.
template <class Value>
class SectorUpdate {
 public:
  void run(const SurfaceTable& surfaces, const Vec3i& key, int reach, const SurfaceChanges& changes,
           DistanceSector& sector) {
    reach_ = reach;
    is_guess_ = false;
    if (sector.isEmpty() || countAdded(changes) > kMostAdded) {
      return workOut(surfaces, key, sector);
    }
    uint64_t anew = 0;
    for (int part = 0; part < kCubesPerSector; ++part) {
      if (hasLostNearest(key, part, changes, sector)) anew |= uint64_t{1} << part;
    }
    if (__builtin_popcountll(anew) > kMostPartsAnew) return workOut(surfaces, key, sector);
    for (int part = 0; part < kCubesPerSector; ++part) {
      if ((anew >> part & 1u) != 0) {
        part_.run(surfaces, firstCellOfCube(cubeOfSector(key, part)), reach_);
        is_guess_ = is_guess_ || part_.isGuess();
        std::copy_n(part_.squared(), kCellsPerCube, cellsOf(sector, part));
        noteMost(part, sector);
      } else {
        takeAdded(key, part, changes, sector);
      }
    }
    const uint16_t* const squared = sector.squared.get();
    const auto is_far = [](uint16_t least) { return least == kSquaredFar; };
    if (std::all_of(squared, squared + kCellsPerSector, is_far)) sector.squared.reset();
  }

  /// Of the last one: whether some surfaces could not be read, but may be later.
  bool isGuess() const { return is_guess_; }

 private:
  static size_t countAdded(const SurfaceChanges& changes) {
    size_t count = 0;
    for (const auto* const change : changes) count += countCells(change->added);
    return count;
  }

  static uint16_t* cellsOf(DistanceSector& sector, int part) {
    return sector.squared.get() + static_cast<size_t>(part) * kCellsPerCube;
  }

  static void noteMost(int part, DistanceSector& sector) {
    const uint16_t* const cells = cellsOf(sector, part);
    sector.most[static_cast<size_t>(part)] = *std::max_element(cells, cells + kCellsPerCube);
  }

  /// From a cell of one cube to one of another, squared, at least.
  static int32_t leastBetween(const Vec3i& a, const Vec3i& b) {
    const auto along = [](int32_t cubes) {
      return cubes == 0 ? 0 : std::abs(cubes) * kCubeSide - (kCubeSide - 1);
    };
    const int32_t x = along(a.x - b.x), y = along(a.y - b.y), z = along(a.z - b.z);
    return x * x + y * y + z * z;
  }

  /// Calls visit(work, mask) with the changes that may matter to a part of the sector: a cube.
  template <class Visit>
  void visitNear(const Vec3i& key, int part, const SurfaceChanges& changes, DistanceSector& sector,
                 const Visit& visit) const {
    const Vec3i cube = cubeOfSector(key, part);
    const uint16_t most = sector.most[static_cast<size_t>(part)];
    const CubeUpdate work(cellsOf(sector, part), most, reach_);
    for (const auto* const change : changes) {
      if (leastBetween(cube, change->cube) > std::min<int32_t>(most, reach_ * reach_)) continue;
      visit(work, *change, firstCellOfCube(change->cube) - firstCellOfCube(cube));
    }
  }

  bool hasLostNearest(const Vec3i& key, int part, const SurfaceChanges& changes,
                      DistanceSector& sector) const {
    bool has_lost = false;
    visitNear(key, part, changes, sector,
              [&](const CubeUpdate& work, const auto& change, Vec3i from) {
                visitCells(change.removed, [&](const Vec3i& cell) {
                  has_lost = has_lost || work.isNearestTo(from + cell);
                });
              });
    return has_lost;
  }

  void takeAdded(const Vec3i& key, int part, const SurfaceChanges& changes,
                 DistanceSector& sector) {
    bool is_any = false;
    visitNear(key, part, changes, sector,
              [&](const CubeUpdate& work, const auto& change, Vec3i from) {
                visitCells(change.added, [&](const Vec3i& cell) {
                  work.lower(from + cell);
                  is_any = true;
                });
              });
    if (is_any) noteMost(part, sector);
  }

  /// All of it.
  void workOut(const SurfaceTable& surfaces, const Vec3i& key, DistanceSector& sector) {
    const bool is_any_near = whole_.run(surfaces, firstCellOfCube(cubeOfSector(key, 0)), reach_);
    is_guess_ = whole_.isGuess();
    if (!is_any_near) return sector.squared.reset();
    if (sector.isEmpty()) sector.ownSquares();
    const uint16_t* row = whole_.squared();
    for (int32_t z = 0; z < kSectorSide; ++z) {
      for (int32_t y = 0; y < kSectorSide; ++y) {
        for (int32_t x = 0; x < kSectorSide; x += kCubeSide, row += kCubeSide) {
          const Vec3i at{x, y, z};
          std::copy_n(row, kCubeSide,
                      cellsOf(sector, cubeInSector(cubeOfCell(at))) + indexInCube(at));
        }
      }
    }
    for (int part = 0; part < kCubesPerSector; ++part) noteMost(part, sector);
  }

  int reach_ = 0;
  bool is_guess_ = false;
  BoxDistances<kSectorSide, Value> whole_;
  BoxDistances<kCubeSide, Value> part_;
};

}  // namespace dtsdf
