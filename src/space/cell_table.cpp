#include "space/cell_table.h"

namespace dtsdf {

CubeCells CellTable::find(const Vec3i& cube) const {
  const std::shared_ptr<const CellSector> sector = sectors_.find(packKey(sectorOfCube(cube)));
  return sector == nullptr ? CubeCells() : sector->at(cubeInSector(cube));
}

CubeCells& CellTable::at(const Vec3i& cube) {
  if (is_followed_) insert(touched_, cube);
  return sectors_.open(packKey(sectorOfCube(cube))).make(cubeInSector(cube));
}

void CellTable::removeIfEmpty(const Vec3i& cube) {
  if (!dtsdf::isEmpty(find(cube))) return;
  sectors_.open(packKey(sectorOfCube(cube))).erase(cubeInSector(cube));
}

void CellTable::clear() {
  sectors_.clear();
  touched_.clear();
  fresh_.clear();
  is_followed_ = false;
}

}  // namespace dtsdf
