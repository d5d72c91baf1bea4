/// Squared distances of 32 x 32 x 32 cells to the nearest ones with surfaces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "kernels/space/squared_distances.h"
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

}  // namespace dtsdf
