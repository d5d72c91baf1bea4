/// Squared distances of 32 x 32 x 32 cells to the nearest ones with surfaces.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "space/cell_sector.h"
#include "space/sector_table.h"

namespace dtsdf {

/// No surface is within reach.
constexpr uint16_t kSquaredFar = 0xffff;

struct DistanceSector {
  std::vector<uint16_t> squared;  ///< Cube by cube, as cells of cubes; empty: all are far.
  std::array<uint16_t, kCubesPerSector> most;  ///< The greatest one in each cube.

  /// @pre `squared` is not empty, and the cell is in the sector. @return -1: none is within reach.
  int squaredAt(const Vec3i& cell) const {
    const auto cube = static_cast<size_t>(cubeInSector(cubeOfCell(cell)));
    const uint16_t value = squared[cube * kCellsPerCube + static_cast<size_t>(indexInCube(cell))];
    return value == kSquaredFar ? -1 : value;
  }

  bool isEmpty() const { return squared.empty(); }
  size_t bytes() const { return sizeof(*this) + squared.capacity() * sizeof(uint16_t); }
  size_t recordBytes() const { return sizeof(most) + squared.size() * sizeof(uint16_t); }
  void writeTo(char* record) const {
    std::memcpy(record, most.data(), sizeof(most));
    std::memcpy(record + sizeof(most), squared.data(), squared.size() * sizeof(uint16_t));
  }
  static DistanceSector readFrom(const char* record) {
    DistanceSector sector;
    std::memcpy(sector.most.data(), record, sizeof(most));
    sector.squared.resize(static_cast<size_t>(kCubesPerSector) * kCellsPerCube);
    std::memcpy(sector.squared.data(), record + sizeof(most),
                sector.squared.size() * sizeof(uint16_t));
    return sector;
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

}  // namespace dtsdf
