#include "space/space_follower.h"

#include <algorithm>
#include <memory>
#include <vector>

namespace dtsdf {
namespace {

CellMask maskOf(const SpaceCube::Mask& words) {
  CellMask mask;
  std::copy(words.begin(), words.end(), mask.word);
  return mask;
}

/// Whose distances are worked out before memory is made for others.
constexpr size_t kMostCubesAtOnce = size_t{1} << 16;

}  // namespace

CellSector SpaceSnapshot::sectorAt(const Vec3i& key) const {
  const auto place = cells_.find(packKey(key));
  if (place == cells_.end()) return {};
  if (const auto sector = place->second.get()) return *sector;
  CellSector lost;
  for (int i = 0; i < kCubesPerSector; ++i) lost.make(i).surface = kAllCells;
  return lost;
}

CellState SpaceSnapshot::stateOf(const Vec3i& cell) const {
  const auto place = cells_.find(packKey(sectorOfCell(cell)));
  const auto sector = place == cells_.end() ? nullptr : place->second.get();
  if (sector == nullptr) return CellState::kUnknown;
  return stateIn(sector->at(cubeInSector(cubeOfCell(cell))), indexInCube(cell));
}

std::vector<SpaceCube> SpaceSnapshot::cubesOf(const Vec3i& sector, const Paged<CellSector>& paged) {
  std::vector<SpaceCube> cubes;
  if (const auto cells = paged.get()) {
    cells->visit([&](int number, const CubeCells& cube) {
      cubes.push_back(asSpaceCube(cubeOfSector(sector, number), cube));
    });
  }
  return cubes;
}

std::vector<SpaceCube> SpaceSnapshot::cubes(int32_t first_z, int32_t last_z) const {
  const int32_t low = first_z >> kCubeSideLog2, high = last_z >> kCubeSideLog2;
  std::vector<SpaceCube> found;
  for (const auto& [key, paged] : cells_) {
    const Vec3i sector = unpackKey(key);
    if (sector.z < first_z >> kSectorSideLog2 || sector.z > last_z >> kSectorSideLog2) continue;
    for (const SpaceCube& cube : cubesOf(sector, paged)) {
      const int32_t z = SpaceCube::cubeOf(cube.first).z;
      if (z >= low && z <= high) found.push_back(cube);
    }
  }
  return found;
}

SpaceDistance SpaceSnapshot::distanceAt(const Eigen::Vector3d& p_W) const {
  return interpolatedDistance(*this, distances_, reach_, p_W);
}

void SpaceFollower::apply(const SpaceChanges& changes, double cell_size_m) {
  if (changes.begins_anew) startOver(cell_size_m);
  CubesOfSectors by_sector;
  for (const SpaceCube& cube : changes.cubes) {
    by_sector[packKey(sectorOfCell(cube.first))].push_back(&cube);
  }
  std::vector<CubeMask> surfaces;
  for (const auto& of_sector : by_sector) {
    applyCells(of_sector);
    for (const SpaceCube* const cube : of_sector.second) {
      surfaces.push_back({SpaceCube::cubeOf(cube->first), maskOf(cube->surface)});
    }
    if (surfaces.size() < kMostCubesAtOnce) continue;
    field_.update(surfaces);
    surfaces.clear();
  }
  field_.update(surfaces);
  now_.distances_ = field_.sectors();
}

void SpaceFollower::startOver(double cell_size_m) {
  now_ = SpaceSnapshot();
  now_.cell_size_m_ = cell_size_m;
  now_.reach_ = reachInCells(max_distance_m_, cell_size_m);
  field_ = DistanceField(now_.reach_, threads_, pages_);
}

/// A sector that changes is copied once, whatever changes in it. Of one that cannot be read only
/// what changes is known then.
void SpaceFollower::applyCells(const CubesOfSectors::value_type& of_sector) {
  const auto known = now_.cells_.find(of_sector.first);
  const auto before = known == now_.cells_.end() ? nullptr : known->second.get();
  const auto cells =
      before == nullptr ? std::make_shared<CellSector>() : std::make_shared<CellSector>(*before);
  for (const SpaceCube* const cube : of_sector.second) {
    const int number = cubeInSector(SpaceCube::cubeOf(cube->first));
    const CubeCells now{maskOf(cube->free), maskOf(cube->surface)};
    if (isEmpty(now)) {
      cells->erase(number);
    } else {
      cells->make(number) = now;
    }
  }
  if (cells->isEmpty()) {
    now_.cells_.erase(of_sector.first);
  } else {
    now_.cells_[of_sector.first] = Paged<CellSector>(cells, pages_);
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
