#include "space/distance_task.h"

#include <algorithm>
#include <memory>

namespace dtsdf {

DistanceTask TaskOfDistances::gather(const SurfaceTable& surfaces,
                                     const std::vector<Vec3i>& sectors, int reach) {
  stacks_.clear();
  places_.clear();
  sectors_.clear();
  cubes_.clear();
  is_guess_.clear();
  place_of_.clear();
  is_unread_.clear();
  DistanceTask task{};
  for (size_t first = 0, end = 0; first < sectors.size(); first = end) {
    while (end < sectors.size() &&
           sectors[end] == sectors[first] + Vec3i{0, 0, static_cast<int32_t>(end - first)}) {
      ++end;
    }
    const auto count = static_cast<int32_t>(end - first);
    const int32_t planes = planesOf(count, reach);
    stacks_.push_back({count, static_cast<int32_t>(places_.size()), static_cast<int32_t>(first),
                       task.plane_count});
    task.plane_count += planes;
    task.most_planes = std::max(task.most_planes, planes);
    addStack(surfaces, sectors[first], count, reach);
  }
  task.reach = reach;
  task.stack_count = static_cast<int32_t>(stacks_.size());
  task.place_count = static_cast<int32_t>(places_.size());
  task.sector_count = static_cast<int32_t>(sectors_.size());
  task.cube_count = static_cast<int32_t>(cubes_.size());
  task.wanted = static_cast<int32_t>(sectors.size());
  task.stacks = stacks_.data();
  task.places = places_.data();
  task.sectors = sectors_.data();
  task.cubes = cubes_.data();
  return task;
}

void TaskOfDistances::addStack(const SurfaceTable& surfaces, const Vec3i& first, int count,
                               int reach) {
  const int32_t ring = ringOf(reach);
  bool is_any = false, is_guess = false;
  for (int32_t z = -ring; z < count + ring; ++z) {
    for (int32_t y = -ring; y <= ring; ++y) {
      for (int32_t x = -ring; x <= ring; ++x) {
        places_.push_back(placeOf(surfaces, first + Vec3i{x, y, z}));
        if (places_.back() < 0) continue;
        is_any = true;
        is_guess = is_guess || is_unread_[static_cast<size_t>(places_.back())] != 0;
      }
    }
  }
  is_guess_.insert(is_guess_.end(), static_cast<size_t>(count), is_guess);
  if (is_any) return;
  places_.resize(static_cast<size_t>(stacks_.back().window));
  stacks_.back().window = -1;
}

int32_t TaskOfDistances::placeOf(const SurfaceTable& surfaces, const Vec3i& sector) {
  const PackedKey key = packKey(sector);
  const auto [known, is_new] = place_of_.try_emplace(key, -1);
  if (is_new) known->second = add(surfaces, key);
  return known->second;
}

/// @return -1: it has no surfaces.
int32_t TaskOfDistances::add(const SurfaceTable& surfaces, PackedKey key) {
  const std::shared_ptr<const CellSector> cells = surfaces.find(key);
  if (cells == nullptr && !surfaces.has(key)) return -1;
  SurfaceCubes sector{0, static_cast<int32_t>(cubes_.size())};
  if (cells != nullptr) {
    cells->visit([&](int number, const CubeCells& cube) {
      sector.known |= uint64_t{1} << number;
      cubes_.push_back(cube.surface);
    });
  } else {
    sector.known = ~uint64_t{0};
    cubes_.insert(cubes_.end(), kCubesPerSector, kAllCells);
  }
  is_unread_.push_back(cells == nullptr && !surfaces.isLost(key));
  sectors_.push_back(sector);
  return static_cast<int32_t>(sectors_.size()) - 1;
}

}  // namespace dtsdf
