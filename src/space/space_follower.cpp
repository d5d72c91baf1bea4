#include "space/space_follower.h"

#include <algorithm>
#include <limits>

#include "space/cell_units.h"

namespace dtsdf {
namespace {

CellMask maskOf(const SpaceCube::Mask& words) {
  CellMask mask;
  std::copy(words.begin(), words.end(), mask.word);
  return mask;
}

bool isAllEmpty(const std::array<CellMask, kCubesPerSector>& masks) {
  return std::all_of(masks.begin(), masks.end(), [](const CellMask& m) { return isEmpty(m); });
}

}  // namespace

CellState SpaceSnapshot::stateOf(const Vec3i& cell) const {
  const auto sector = cells_.find(packKey(sectorOfCell(cell)));
  if (sector == cells_.end()) return CellState::kUnknown;
  const auto cube = static_cast<size_t>(cubeInSector(cubeOfCell(cell)));
  if (isIn(sector->second->surface[cube], indexInCube(cell))) return CellState::kSurface;
  return isIn(sector->second->free[cube], indexInCube(cell)) ? CellState::kFree
                                                             : CellState::kUnknown;
}

SpaceCube SpaceSnapshot::cubeOf(const Vec3i& sector, int number, const Cells& cells) {
  const auto i = static_cast<size_t>(number);
  SpaceCube cube{firstCellOfCube(cubeOfSector(sector, number)), {}, {}};
  std::copy_n(cells.free[i].word, kWordsPerCube, cube.free.begin());
  std::copy_n(cells.surface[i].word, kWordsPerCube, cube.surface.begin());
  return cube;
}

std::vector<SpaceCube> SpaceSnapshot::cubes() const {
  return cubes(std::numeric_limits<int32_t>::min(), std::numeric_limits<int32_t>::max());
}

std::vector<SpaceCube> SpaceSnapshot::cubes(int32_t first_z, int32_t last_z) const {
  const int32_t low = first_z >> kCubeSideLog2, high = last_z >> kCubeSideLog2;
  std::vector<SpaceCube> found;
  for (const auto& [key, cells] : cells_) {
    const Vec3i sector = unpackKey(key);
    if (sector.z < first_z >> kSectorSideLog2 || sector.z > last_z >> kSectorSideLog2) continue;
    for (int i = 0; i < kCubesPerSector; ++i) {
      const auto number = static_cast<size_t>(i);
      const int32_t z = cubeOfSector(sector, i).z;
      if (z < low || z > high) continue;
      if (dtsdf::isEmpty(cells->free[number]) && dtsdf::isEmpty(cells->surface[number])) continue;
      found.push_back(cubeOf(sector, i, *cells));
    }
  }
  return found;
}

SpaceDistance SpaceSnapshot::distanceAt(const Eigen::Vector3d& p_W) const {
  const auto around = cellsAround(p_W, units_);
  if (!around) return unknownDistance(units_);
  int squared[8];
  const Vec3i first = sectorOfCell(around->cell(0)), last = sectorOfCell(around->cell(7));
  if (packKey(first) == packKey(last)) {
    const auto sector = distances_.find(packKey(first));
    for (int i = 0; i < 8; ++i) {
      squared[i] = sector == distances_.end() ? -1 : sector->second->squaredAt(around->cell(i));
    }
  } else {
    for (int i = 0; i < 8; ++i) squared[i] = squaredDistance(around->cell(i));
  }
  return interpolate(*around, squared, stateOf(cellAt(p_W)) != CellState::kUnknown, units_);
}

void SpaceFollower::apply(const SpaceChanges& changes, double cell_size_m) {
  if (changes.begins_anew) startOver(cell_size_m);
  applyCells(changes.cubes);
  std::vector<SurfaceCube> surfaces;
  surfaces.reserve(changes.cubes.size());
  for (const SpaceCube& cube : changes.cubes) {
    surfaces.push_back({SpaceCube::cubeOf(cube.first), maskOf(cube.surface)});
  }
  field_.update(surfaces);
  now_.distances_ = field_.sectors();
}

void SpaceFollower::startOver(double cell_size_m) {
  now_ = SpaceSnapshot();
  now_.units_ = {cell_size_m, reachInCells(max_distance_m_, cell_size_m)};
  field_ = DistanceField(now_.units_.reach, threads_);
}

/// Each sector that changes is copied once, whatever changes in it.
void SpaceFollower::applyCells(const std::vector<SpaceCube>& cubes) {
  std::unordered_map<PackedKey, std::shared_ptr<SpaceSnapshot::Cells>> changed;
  for (const SpaceCube& cube : cubes) {
    const PackedKey key = packKey(sectorOfCell(cube.first));
    std::shared_ptr<SpaceSnapshot::Cells>& cells = changed[key];
    if (cells == nullptr) {
      const auto known = now_.cells_.find(key);
      cells = known == now_.cells_.end() ? std::make_shared<SpaceSnapshot::Cells>()
                                         : std::make_shared<SpaceSnapshot::Cells>(*known->second);
    }
    const auto number = static_cast<size_t>(cubeInSector(cubeOfCell(cube.first)));
    cells->free[number] = maskOf(cube.free);
    cells->surface[number] = maskOf(cube.surface);
  }
  for (auto& [key, cells] : changed) {
    if (isAllEmpty(cells->free) && isAllEmpty(cells->surface)) {
      now_.cells_.erase(key);
    } else {
      now_.cells_[key] = std::move(cells);
    }
  }
}

size_t SpaceFollower::bytes() const {
  return now_.cells_.size() * (sizeof(SpaceSnapshot::Cells) + sizeof(PackedKey)) + field_.bytes();
}

}  // namespace dtsdf
