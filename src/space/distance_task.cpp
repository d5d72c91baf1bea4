#include "space/distance_task.h"

#include <algorithm>
#include <memory>

namespace dtsdf {

DistanceTask TaskOfDistances::gather(const SurfaceTable& surfaces,
                                     const std::vector<Vec3i>& sectors, int reach) {
  DistanceTask task{};
  task.reach = reach;
  ring_ = ringOf(reach);
  layOut(sectors, task);
  fill(surfaces);
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

/// Box and stacks.
void TaskOfDistances::layOut(const std::vector<Vec3i>& sectors, DistanceTask& task) {
  box_ = {sectors.front(), sectors.front()};
  for (const Vec3i& sector : sectors) box_ = around(box_, {sector, sector});
  box_ = grown(box_, ring_, ring_);
  task.box_x = edgesOf(box_).x;
  task.box_y = edgesOf(box_).y;
  stacks_.clear();
  for (size_t first = 0, end = 0; first < sectors.size(); first = end) {
    Vec3i next = sectors[first];
    for (; end < sectors.size() && sectors[end] == next; ++end) ++next.z;
    const auto count = static_cast<int32_t>(end - first);
    const int32_t planes = planesOf(count, task.reach);
    stacks_.push_back(
        {count, placeOf(sectors[first]), static_cast<int32_t>(first), task.plane_count});
    task.plane_count += planes;
    task.most_planes = std::max(task.most_planes, planes);
  }
}

int32_t TaskOfDistances::placeOf(const Vec3i& sector) const {
  const Vec3i at = sector - box_.first, size = edgesOf(box_);
  return at.x + size.x * (at.y + size.y * at.z);
}

/// The surfaces in the box.
void TaskOfDistances::fill(const SurfaceTable& surfaces) {
  places_.assign(volumeOf(box_), -1);
  sectors_.clear();
  cubes_.clear();
  if (surfaces.size() < places_.size()) {
    for (const PackedKey key : surfaces.keys()) {
      const Vec3i sector = unpackKey(key);
      if (box_.contains(sector)) add(surfaces, key, places_[static_cast<size_t>(placeOf(sector))]);
    }
    return;
  }
  size_t place = 0;
  for (int32_t z = box_.first.z; z <= box_.last.z; ++z) {
    for (int32_t y = box_.first.y; y <= box_.last.y; ++y) {
      for (int32_t x = box_.first.x; x <= box_.last.x; ++x, ++place) {
        const PackedKey key = packKey({x, y, z});
        if (surfaces.has(key)) add(surfaces, key, places_[place]);
      }
    }
  }
}

void TaskOfDistances::add(const SurfaceTable& surfaces, PackedKey key, int32_t& place) {
  place = static_cast<int32_t>(sectors_.size());
  SurfaceCubes sector{0, static_cast<int32_t>(cubes_.size())};
  if (const std::shared_ptr<const CellSector> cells = surfaces.find(key)) {
    cells->visit([&](int number, const CubeCells& cube) {
      sector.known |= uint64_t{1} << number;
      cubes_.push_back(cube.surface);
    });
  } else {
    sector.known = ~uint64_t{0};
    cubes_.insert(cubes_.end(), kCubesPerSector, kAllCells);
  }
  sectors_.push_back(sector);
}

}  // namespace dtsdf
