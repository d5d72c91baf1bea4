#include "space/cell_table.h"

namespace dtsdf {

CubeCells CellTable::find(const Vec3i& cube) const {
  const std::shared_ptr<const CellSector> sector = sectors_.find(packKey(sectorOfCube(cube)));
  return sector == nullptr ? CubeCells() : sector->at(cubeInSector(cube));
}

CubeCells& CellTable::at(const Vec3i& cube) {
  const PackedKey key = packKey(sectorOfCube(cube));
  const size_t lost = sectors_.lost().size();
  CellSector& sector = sectors_.open(key);
  if (sectors_.lost().size() > lost) touched_.erase(key);  // nobody knows what is in the others
  if (is_followed_) insert(touched_, cube);
  return sector.make(cubeInSector(cube));
}

void CellTable::removeIfEmpty(const Vec3i& cube) {
  const PackedKey key = packKey(sectorOfCube(cube));
  const std::shared_ptr<const CellSector> sector = sectors_.find(key);
  if (sector == nullptr || !dtsdf::isEmpty(sector->at(cubeInSector(cube)))) return;
  sectors_.open(key).erase(cubeInSector(cube));
}

SpaceChanges CellTable::takeTouched(bool all, size_t most) {
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

void CellTable::clear() {
  sectors_.clear();
  touched_.clear();
  fresh_.clear();
  is_followed_ = false;
}

}  // namespace dtsdf
