#include "space/space_follower.h"

#include <algorithm>
#include <memory>

namespace dtsdf {
namespace {

CellMask maskOf(const SpaceCube::Mask& words) {
  CellMask mask;
  std::copy(words.begin(), words.end(), mask.word);
  return mask;
}

}  // namespace

void SpaceFollower::apply(const SpaceChanges& changes, double cell_size_m) {
  if (changes.begins_anew) startOver(cell_size_m);
  CubesOfSectors by_sector;
  for (const SpaceCube& cube : changes.cubes) {
    by_sector[packKey(sectorOfCell(cube.first))].push_back(&cube);
  }
  for (const auto& sector_entry : by_sector) applyCells(sector_entry);
  field_.update(now_.cells_);
  now_.distances_ = field_.sectors();
}

void SpaceFollower::startOver(double cell_size_m) {
  now_ = SpaceSnapshot();
  now_.cell_size_m_ = cell_size_m;
  now_.reach_ = reachInCells(max_distance_m_, cell_size_m);
  field_ = DistanceField(now_.reach_, threads_, pages_);
}

/// Copies a sector (see cell_sector.h) only once, even if several of its cubes change.
void SpaceFollower::applyCells(const CubesOfSectors::value_type& sector_entry) {
  const auto known = now_.cells_.find(sector_entry.first);
  const auto cells = std::make_shared<CellSector>();
  if (known != now_.cells_.end()) {
    const auto before = known->second.get();
    *cells = before == nullptr ? CellSector::lost() : *before;
  }
  for (const SpaceCube* const cube : sector_entry.second) {
    const Vec3i key = SpaceCube::cubeOf(cube->first);
    const int number = cubeInSector(key);
    const CubeCells now{maskOf(cube->free), maskOf(cube->surface)}, before = cells->at(number);
    if (!std::equal(now.surface.word, now.surface.word + kWordsPerCube, before.surface.word)) {
      field_.noteChange(key);
    }
    if (isEmpty(now)) {
      cells->erase(number);
    } else {
      cells->make(number) = now;
    }
  }
  if (cells->isEmpty()) {
    now_.cells_.erase(sector_entry.first);
  } else {
    now_.cells_[sector_entry.first] = Paged<CellSector>(cells, pages_);
  }
}

size_t SpaceFollower::bytes() const {
  size_t bytes = field_.bytes() + (pages_ == nullptr ? 0 : pages_->bytes());
  for (const auto& [key, cells] : now_.cells_) {
    bytes += sizeof(key) + sizeof(cells);
    if (pages_ == nullptr) bytes += cells.get()->bytes();
  }
  return bytes;
}

}  // namespace dtsdf
