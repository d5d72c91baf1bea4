/// Squared distances of 32 x 32 x 32 cells to the nearest ones with surfaces.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "kernels/space/cells.h"

namespace dtsdf {

/// A sector is large beside a reach of usual length, so that little of the window around one is
/// looked at in vain.
constexpr int kSectorSideLog2 = 5;
constexpr int kSectorSide = 1 << kSectorSideLog2;  ///< In cells.
constexpr int kCubesAlong = kSectorSide / kCubeSide;
constexpr int kCubesPerSector = kCubesAlong * kCubesAlong * kCubesAlong;

/// No surface is within reach.
constexpr uint16_t kSquaredFar = 0xffff;

inline Vec3i sectorOfCell(const Vec3i& cell) { return shiftDown(cell, kSectorSideLog2); }

/// Its number in its sector.
inline int cubeInSector(const Vec3i& cube) {
  constexpr int32_t kMask = kCubesAlong - 1;
  return (cube.x & kMask) + kCubesAlong * ((cube.y & kMask) + kCubesAlong * (cube.z & kMask));
}

/// The cube of a number.
inline Vec3i cubeOfSector(const Vec3i& sector, int number) {
  return {sector.x * kCubesAlong + number % kCubesAlong,
          sector.y * kCubesAlong + number / kCubesAlong % kCubesAlong,
          sector.z * kCubesAlong + number / (kCubesAlong * kCubesAlong)};
}

struct DistanceSector {
  std::vector<uint16_t> squared;  ///< Cube by cube, as cells of cubes; empty: all are far.
  std::array<uint16_t, kCubesPerSector> most;  ///< The greatest one in each cube.

  /// @pre `squared` is not empty, and the cell is in the sector. @return -1: none is within reach.
  int squaredAt(const Vec3i& cell) const {
    const auto cube = static_cast<size_t>(cubeInSector(cubeOfCell(cell)));
    const uint16_t value = squared[cube * kCellsPerCube + static_cast<size_t>(indexInCube(cell))];
    return value == kSquaredFar ? -1 : value;
  }
};

/// Cells with surfaces, by the key of their cube; cubes without any are not there.
using SurfaceTable = std::unordered_map<PackedKey, CellMask>;

/// Surfaces that came and went in a cube.
struct SurfaceChange {
  Vec3i cube;
  CellMask added, removed;
};

}  // namespace dtsdf
