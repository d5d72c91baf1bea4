/// The cells that something is known of, by cubes of 8 x 8 x 8.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "space/cell_sector.h"
#include "space/sector_table.h"

namespace dtsdf {

/// Cubes, by their sectors, in order: a bit for each.
using CubeSet = std::map<PackedKey, uint64_t>;

inline void insert(CubeSet& cubes, const Vec3i& cube) {
  cubes[packKey(sectorOfCube(cube))] |= uint64_t{1} << cubeInSector(cube);
}

/// Calls visit(cube, number) for each of a sector.
template <class Visit>
void visitCubes(const CubeSet::value_type& of_sector, const Visit& visit) {
  const Vec3i sector = unpackKey(of_sector.first);
  for (uint64_t left = of_sector.second; left != 0; left &= left - 1) {
    const int number = __builtin_ctzll(left);
    visit(cubeOfSector(sector, number), number);
  }
}

class CellTable {
 public:
  explicit CellTable(SharedPagedValues pages = nullptr) : sectors_(std::move(pages)) {}

  /// What is known of a cube.
  CubeCells find(const Vec3i& cube) const {
    const std::shared_ptr<const CellSector> sector = sectors_.find(packKey(sectorOfCube(cube)));
    return sector == nullptr ? CubeCells() : sector->at(cubeInSector(cube));
  }

  /// The cube, made if it is not there, until another one is asked for. It counts as touched.
  CubeCells& at(const Vec3i& cube) {
    const PackedKey key = packKey(sectorOfCube(cube));
    const size_t lost = sectors_.lost().size();
    CellSector& sector = sectors_.open(key);
    if (sectors_.lost().size() > lost) touched_.erase(key);  // nobody knows what is in the others
    if (is_followed_) insert(touched_, cube);
    return sector.make(cubeInSector(cube));
  }

  /// Calls visit(cube, cells) for these cubes, also for those that have gone. @return false: they
  /// cannot be read, and nobody knows what is there.
  template <class Visit>
  bool visitSome(const CubeSet::value_type& of_sector, const Visit& visit) const {
    const PackedKey key = of_sector.first;
    const std::shared_ptr<const CellSector> sector = sectors_.find(key);
    if (sector == nullptr && sectors_.has(key)) return false;
    visitCubes(of_sector, [&](const Vec3i& cube, int number) {
      visit(cube, sector == nullptr ? CubeCells() : sector->at(number));
    });
    return true;
  }

  /// Sectors that could not be read, of which only what came since is known now.
  std::vector<PackedKey> takeLost() {
    std::vector<PackedKey> lost = sectors_.lost();
    sectors_.forgetLost();
    return lost;
  }

  /// Removes a cube of which nothing is known any more.
  void removeIfEmpty(const Vec3i& cube) {
    const PackedKey key = packKey(sectorOfCube(cube));
    const std::shared_ptr<const CellSector> sector = sectors_.find(key);
    if (sector == nullptr || !dtsdf::isEmpty(sector->at(cubeInSector(cube)))) return;
    sectors_.open(key).erase(cubeInSector(cube));
  }

  /// What was changed may go to the disk: to be called at the end.
  void close() { sectors_.close(); }

  void clear() {
    sectors_.clear();
    touched_.clear();
    fresh_.clear();
    is_followed_ = false;
  }

  /// Calls visit(cube, cells) for each cube of the sectors that `takes`, in no order; it may change
  /// that one. Those that cannot be read are left out.
  template <class TakesSector, class Visit>
  void visit(const TakesSector& takes, const Visit& visit) const {
    for (const PackedKey key : sectors_.keys()) {
      const Vec3i sector = unpackKey(key);
      if (!takes(sector)) continue;
      const std::shared_ptr<const CellSector> cells = sectors_.find(key);
      if (cells == nullptr) continue;
      std::vector<std::pair<Vec3i, CubeCells>>
          cubes;  // which stay while those in the sector change
      cells->visit([&](int number, const CubeCells& cube) {
        cubes.emplace_back(cubeOfSector(sector, number), cube);
      });
      for (const auto& [cube, of_cube] : cubes) visit(cube, of_cube);
    }
  }

  /// Cubes that were touched since the last call, or have gone; at the first one, and with `all`,
  /// all that there are. About so many at most: the rest with the next calls, as what is touched
  /// and cannot be read now.
  SpaceChanges takeTouched(bool all, size_t most) {
    SpaceChanges taken;
    taken.begins_anew = all || !is_followed_;
    if (taken.begins_anew) {
      fresh_ = sectors_.keys();
      touched_.clear();
      is_followed_ = true;
    }
    const auto take = [&](const Vec3i& cube, const CubeCells& cells) {
      taken.cubes.push_back(asSpaceCube(cube, cells));
    };
    for (; !fresh_.empty() && taken.cubes.size() < most; fresh_.pop_back()) {
      const PackedKey key = fresh_.back();
      const std::shared_ptr<const CellSector> sector = sectors_.find(key);
      if (sector == nullptr) continue;
      const Vec3i at = unpackKey(key);
      sector->visit([&](int i, const CubeCells& cells) { take(cubeOfSector(at, i), cells); });
    }
    auto next = touched_.begin();
    while (next != touched_.end() && taken.cubes.size() < most) {
      if (visitSome(*next, take)) {
        next = touched_.erase(next);
      } else {
        ++next;
      }
    }
    taken.is_part = !fresh_.empty() || next != touched_.end();
    return taken;
  }

  bool isEmpty() const { return sectors_.size() == 0; }
  size_t bytes() const { return sectors_.bytes() + touched_.size() * kSetNodeBytes; }

  static constexpr size_t kSetNodeBytes = sizeof(CubeSet::value_type) + 3 * sizeof(void*);

 private:
  SectorTable<CellSector> sectors_;
  bool is_followed_ = false;      ///< Changes were taken, and all since then are known:
  CubeSet touched_;               ///< these,
  std::vector<PackedKey> fresh_;  ///< and all of these sectors.
};

}  // namespace dtsdf
