/// Gathers the surface cells from which distances in sectors (see cell_sector.h) are computed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/space/squared_distances.h"
#include "map/block_extent.h"
#include "space/cell_sector.h"
#include "space/sector_table.h"

namespace dtsdf {

/// Squared distances of all cells of a sector, ordered by cube, then by cell of the cube.
using SectorSquares = std::shared_ptr<uint16_t[]>;
constexpr size_t kSquaresBytes = kCellsPerSector * sizeof(uint16_t);

/// Index of a cell in SectorSquares, given its coordinates in the map or relative to its sector.
inline size_t placeInSector(const Vec3i& cell) {
  const auto cube = static_cast<size_t>(cubeInSector(cubeOfCell(cell)));
  return cube * kCellsPerCube + static_cast<size_t>(indexInCube(cell));
}

/// Squared distances from the cells of a sector to the nearest cells with surfaces.
struct DistanceSector {
  SectorSquares squared;  ///< Null if no surface is within the maximum distance.

  /// @pre `squared` is not null, and the cell is in the sector. @return -1 if no surface is within
  /// the maximum distance.
  int squaredAt(const Vec3i& cell) const {
    const uint16_t value = squared[placeInSector(cell)];
    return value == kSquaredFar ? -1 : value;
  }

  bool isEmpty() const { return squared == nullptr; }

  /// Memory use of a sector that is not empty, for PagedValues.
  size_t bytes() const { return sizeof(*this) + kSquaresBytes; }
  template <class Io>
  void visitRecord(Io& io) {
    if (isEmpty()) squared = SectorSquares(new uint16_t[kCellsPerSector]);  // when reading
    io.array(squared.get(), size_t{kCellsPerSector});
  }
};

/// Builds distance tasks. The buffers are reused for each task.
class DistanceTaskBuilder {
 public:
  /// @param sectors The sectors in which to compute distances, sorted by x, then y, then z. Memory
  /// use grows with the volume of the box around them.
  /// @param reach Maximum distance, in cells.
  /// @return a task that is valid until the next call.
  DistanceTask gather(const CellSectors& cells, const std::vector<Vec3i>& sectors, int reach) {
    DistanceTask task{};
    task.reach = reach;
    ring_ = sectorsInReach(reach);
    layOut(sectors, task);
    fill(cells);
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

 private:
  /// Sets the box, and groups sectors that adjoin along z into stacks.
  void layOut(const std::vector<Vec3i>& sectors, DistanceTask& task) {
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
      task.max_planes = std::max(task.max_planes, planes);
    }
  }

  /// Collects the surfaces in the box.
  void fill(const CellSectors& cells) {
    places_.assign(volumeOf(box_), -1);
    sectors_.clear();
    cubes_.clear();
    size_t place = 0;
    for (int32_t z = box_.first.z; z <= box_.last.z; ++z) {
      for (int32_t y = box_.first.y; y <= box_.last.y; ++y) {
        for (int32_t x = box_.first.x; x <= box_.last.x; ++x, ++place) {
          if (const auto sector = surfacesIn(cells, packKey({x, y, z}))) {
            add(*sector, places_[place]);
          }
        }
      }
    }
  }

  void add(const CellSector& cells, int32_t& place) {
    SurfaceCubes sector{0, static_cast<int32_t>(cubes_.size())};
    cells.visit([&](int number, const CubeCells& cube) {
      if (isEmpty(cube.surface)) return;
      sector.known |= uint64_t{1} << number;
      cubes_.push_back(cube.surface);
    });
    if (sector.known == 0) return;
    place = static_cast<int32_t>(sectors_.size());
    sectors_.push_back(sector);
  }

  int32_t placeOf(const Vec3i& sector) const {
    const Vec3i at = sector - box_.first, size = edgesOf(box_);
    return at.x + size.x * (at.y + size.y * at.z);
  }

  int32_t ring_ = 0;
  BlockExtent box_;  ///< Box around the sectors and all sectors within the maximum distance.
  std::vector<SectorStack> stacks_;
  std::vector<int32_t> places_;
  std::vector<SurfaceCubes> sectors_;
  std::vector<CellMask> cubes_;
};

}  // namespace dtsdf
