/// Sectors of 32 x 32 x 32 cells, of 4 x 4 x 4 cubes.
#pragma once

#include "kernels/space/cells.h"

namespace dtsdf {

/// A sector is large beside a reach of usual length, so that little of the window around one is
/// looked at in vain.
constexpr int kSectorSideLog2 = 5;
constexpr int kSectorSide = 1 << kSectorSideLog2;  ///< In cells.
constexpr int kCubesAlong = kSectorSide / kCubeSide;
constexpr int kCubesPerSector = kCubesAlong * kCubesAlong * kCubesAlong;
constexpr int kCellsPerSector = kCubesPerSector * kCellsPerCube;

DTSDF_HD Vec3i sectorOfCell(const Vec3i& cell) { return shiftDown(cell, kSectorSideLog2); }
DTSDF_HD Vec3i sectorOfCube(const Vec3i& cube) {
  return shiftDown(cube, kSectorSideLog2 - kCubeSideLog2);
}

/// Its number in its sector.
DTSDF_HD int cubeInSector(const Vec3i& cube) {
  constexpr int32_t kMask = kCubesAlong - 1;
  return (cube.x & kMask) + kCubesAlong * ((cube.y & kMask) + kCubesAlong * (cube.z & kMask));
}

/// The cube of a number.
DTSDF_HD Vec3i cubeOfSector(const Vec3i& sector, int number) {
  return {sector.x * kCubesAlong + number % kCubesAlong,
          sector.y * kCubesAlong + number / kCubesAlong % kCubesAlong,
          sector.z * kCubesAlong + number / (kCubesAlong * kCubesAlong)};
}

}  // namespace dtsdf
