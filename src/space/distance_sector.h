/// Squared distances of 32 x 32 x 32 cells to the nearest ones with surfaces.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "kernels/space/squared_distances.h"
#include "space/cell_sector.h"
#include "space/sector_table.h"

namespace dtsdf {

/// Of all cells of a sector, cube by cube, as cells of cubes.
using SectorSquares = std::shared_ptr<uint16_t[]>;
constexpr size_t kSquaresBytes = kCellsPerSector * sizeof(uint16_t);

struct DistanceSector {
  SectorSquares squared;                       ///< Null: all are far.
  std::array<uint16_t, kCubesPerSector> most;  ///< No less than the greatest one in each cube.

  /// @pre `squared` is not null, and the cell is in the sector. @return -1: none is within reach.
  int squaredAt(const Vec3i& cell) const {
    const auto cube = static_cast<size_t>(cubeInSector(cubeOfCell(cell)));
    const uint16_t value = squared[cube * kCellsPerCube + static_cast<size_t>(indexInCube(cell))];
    return value == kSquaredFar ? -1 : value;
  }

  bool isEmpty() const { return squared == nullptr; }

  /// Room of its own for squares, with those that there are.
  void ownSquares() {
    const SectorSquares shared = squared;
    squared = SectorSquares(new uint16_t[kCellsPerSector]);
    if (shared != nullptr) std::memcpy(squared.get(), shared.get(), kSquaresBytes);
  }

  /// As pages ask for them, which keep none that is empty.
  size_t bytes() const { return sizeof(*this) + kSquaresBytes; }
  template <class Io>
  void visitRecord(Io& io) {
    if (isEmpty()) ownSquares();  // it is read
    io.array(most.data(), most.size());
    io.array(squared.get(), size_t{kCellsPerSector});
  }
};

/// Cells with surfaces; cubes without any are not there.
using SurfaceTable = SectorTable<CellSector>;

/// Surfaces that came and went in a cube.
struct SurfaceChange {
  Vec3i cube;
  CellMask added, removed;
  bool is_guess = false;  ///< What was there before cannot be read now.
};

/// Some of them.
using SurfaceChanges = std::vector<const SurfaceChange*>;

}  // namespace dtsdf
