/// The known cells of a map's free-space grid, in cubes of 8 x 8 x 8.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "space/cell_sector.h"
#include "space/sector_table.h"

namespace dtsdf {

class CellTable {
 public:
  explicit CellTable(SharedPagedValues pages = nullptr) : sectors_(std::move(pages)) {}

  CubeCells find(const Vec3i& cube) const {
    const std::shared_ptr<const CellSector> sector = sectors_.find(packKey(sectorOfCube(cube)));
    return sector == nullptr ? CubeCells() : sector->at(cubeInSector(cube));
  }

  /// Returns a cube, adding it if it is missing. Marks it as touched if takeTouched() was called
  /// before. The reference is valid until the next call.
  CubeCells& at(const Vec3i& cube) {
    if (tracks_changes_) insert(touched_, cube);
    return sectors_.open(packKey(sectorOfCube(cube))).make(cubeInSector(cube));
  }

  /// Removes a cube if it has no known cells left.
  void removeIfEmpty(const Vec3i& cube) {
    const PackedKey key = packKey(sectorOfCube(cube));
    const std::shared_ptr<const CellSector> sector = sectors_.find(key);
    if (sector == nullptr || !dtsdf::isEmpty(sector->at(cubeInSector(cube)))) return;
    sectors_.open(key).erase(cubeInSector(cube));
  }

  /// Ends a series of changes; the changed sectors (see cell_sector.h) may then move to disk.
  void close() { sectors_.close(); }

  void clear() {
    sectors_.clear();
    touched_.clear();
    fresh_.clear();
    tracks_changes_ = false;
  }

  /// Calls visit(cube, cells) for each cube in the sectors that `takes` accepts, in no particular
  /// order; `visit` may change that cube. Sectors that cannot be read are skipped.
  template <class TakesSector, class Visit>
  void visit(const TakesSector& takes, const Visit& visit) const {
    for (const PackedKey key : sectors_.keys()) {
      const Vec3i sector = unpackKey(key);
      if (!takes(sector)) continue;
      const std::shared_ptr<const CellSector> cells = sectors_.find(key);
      if (cells == nullptr) continue;
      CellSector(*cells).visit(  // a copy, since visit() may change the sector
          [&](int number, const CubeCells& cube) { visit(cubeOfSector(sector, number), cube); });
    }
  }

  /// Returns the cubes touched or removed since the last call, or all cubes if this is the first
  /// call or `all` is set. Stops after about `most` cubes. The next calls return the rest, and
  /// touched cubes that could not be read this time.
  SpaceChanges takeTouched(bool all, size_t most) {
    SpaceChanges taken;
    taken.begins_anew = all || !tracks_changes_;
    if (taken.begins_anew) {
      fresh_ = sectors_.keys();
      touched_.clear();
      tracks_changes_ = true;
    }
    for (; !fresh_.empty() && taken.cubes.size() < most; fresh_.pop_back()) {
      const auto place = sectors_.all().find(fresh_.back());
      if (place == sectors_.all().end()) continue;
      for (const SpaceCube& cube : cubesOf(*place)) taken.cubes.push_back(cube);
    }
    auto next = touched_.begin();
    while (next != touched_.end() && taken.cubes.size() < most) {
      const std::shared_ptr<const CellSector> sector = sectors_.find(next->first);
      if (sector == nullptr && sectors_.all().count(next->first) > 0) {
        ++next;
        continue;
      }
      visitCubes(*next, [&](const Vec3i& cube, int number) {
        taken.cubes.push_back(
            toSpaceCube(cube, sector == nullptr ? CubeCells() : sector->at(number)));
      });
      next = touched_.erase(next);
    }
    taken.is_part = !fresh_.empty() || next != touched_.end();
    return taken;
  }

  /// All known cells, by sector. @pre close() was called.
  const CellSectors& all() const { return sectors_.all(); }
  size_t bytes() const { return sectors_.bytes() + touched_.size() * kCubeSetNodeBytes; }

 private:
  SectorTable<CellSector> sectors_;
  bool tracks_changes_ = false;   ///< Whether takeTouched() was called.
  CubeSet touched_;               ///< Changed cubes that takeTouched() has yet to return.
  std::vector<PackedKey> fresh_;  ///< Sectors whose cubes takeTouched() has yet to return.
};

}  // namespace dtsdf
