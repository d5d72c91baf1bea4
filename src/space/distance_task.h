/// Gathers what it takes to work out the distances in sectors: the surfaces around them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/space/squared_distances.h"
#include "map/block_extent.h"
#include "space/cell_sector.h"
#include "space/sector_table.h"

namespace dtsdf {

/// Of all cells of a sector, cube by cube, as cells of cubes.
using SectorSquares = std::shared_ptr<uint16_t[]>;
constexpr size_t kSquaresBytes = kCellsPerSector * sizeof(uint16_t);

/// Where a cell's square is; the cell may count from any sector's first one.
inline size_t placeInSector(const Vec3i& cell) {
  const auto cube = static_cast<size_t>(cubeInSector(cubeOfCell(cell)));
  return cube * kCellsPerCube + static_cast<size_t>(indexInCube(cell));
}

/// Squared distances of the cells of a sector to the nearest ones with surfaces.
struct DistanceSector {
  SectorSquares squared;  ///< Null: all are far.

  /// @pre `squared` is not null, and the cell is in the sector. @return -1: none is within reach.
  int squaredAt(const Vec3i& cell) const {
    const uint16_t value = squared[placeInSector(cell)];
    return value == kSquaredFar ? -1 : value;
  }

  bool isEmpty() const { return squared == nullptr; }

  /// As pages ask for them, which keep none that is empty.
  size_t bytes() const { return sizeof(*this) + kSquaresBytes; }
  template <class Io>
  void visitRecord(Io& io) {
    if (isEmpty()) squared = SectorSquares(new uint16_t[kCellsPerSector]);  // it is read
    io.array(squared.get(), size_t{kCellsPerSector});
  }
};

/// Cells with surfaces; cubes without any are not there.
using SurfaceTable = SectorTable<CellSector>;

/// The buffers are kept from task to task.
class TaskOfDistances {
 public:
  /// Sectors that cannot be read count as if they had surfaces everywhere, to be on the safe side.
  /// @param sectors In the order of x, then y, then z.
  /// The box around them must not be large.
  /// @return valid until the next one is gathered.
  DistanceTask gather(const SurfaceTable& surfaces, const std::vector<Vec3i>& sectors, int reach);

 private:
  void layOut(const std::vector<Vec3i>& sectors, DistanceTask& task);
  void fill(const SurfaceTable& surfaces);
  void add(const SurfaceTable& surfaces, PackedKey key, int32_t& place);
  int32_t placeOf(const Vec3i& sector) const;

  int32_t ring_ = 0;
  BlockExtent box_;  ///< Around the sectors, by their keys.
  std::vector<SectorStack> stacks_;
  std::vector<int32_t> places_;
  std::vector<SurfaceCubes> sectors_;
  std::vector<CellMask> cubes_;
};

}  // namespace dtsdf
