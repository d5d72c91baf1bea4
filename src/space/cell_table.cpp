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

bool CellTable::isUnread(const Vec3i& cube) const {
  const PackedKey key = packKey(sectorOfCube(cube));
  return sectors_.has(key) && sectors_.find(key) == nullptr && !sectors_.isLost(key);
}

void CellTable::removeIfEmpty(const Vec3i& cube) {
  const PackedKey key = packKey(sectorOfCube(cube));
  const std::shared_ptr<const CellSector> sector = sectors_.find(key);
  if (sector == nullptr || !dtsdf::isEmpty(sector->at(cubeInSector(cube)))) return;
  sectors_.open(key).erase(cubeInSector(cube));
}

void CellTable::clear() {
  sectors_.clear();
  touched_.clear();
  fresh_.clear();
  is_followed_ = false;
}

}  // namespace dtsdf
