/// Cells of the free-space grid: cubes with an edge of 1, 2, 4 or 8 voxels.
///
/// Cell (i, j, k) with an edge of c voxels spans (i, j, k) * c to (i + 1, j + 1, k + 1) * c voxels
/// of the map frame W. Cells are stored in cubes of 8 x 8 x 8, as voxels are in blocks.
#pragma once

#include "kernels/core/grid.h"

namespace dtsdf {

constexpr int kCubeSideLog2 = 3;
constexpr int kCubeSide = 1 << kCubeSideLog2;  ///< In cells.
constexpr int kCellsPerCube = kCubeSide * kCubeSide * kCubeSide;
constexpr int kWordsPerCube = kCellsPerCube / 64;

/// One bit for each cell of a cube: word z, bit x + 8 y.
struct CellMask {
  uint64_t word[kWordsPerCube];
};

DTSDF_HD int cellIndex(int x, int y, int z) { return x + kCubeSide * (y + kCubeSide * z); }
DTSDF_HD bool isIn(const CellMask& mask, int cell) {
  return (mask.word[cell >> 6] >> (cell & 63) & 1u) != 0;
}
DTSDF_HD void add(CellMask& mask, int cell) { mask.word[cell >> 6] |= uint64_t{1} << (cell & 63); }
DTSDF_HD void remove(CellMask& mask, int cell) {
  mask.word[cell >> 6] &= ~(uint64_t{1} << (cell & 63));
}

DTSDF_HD bool isEmpty(const CellMask& mask) {
  uint64_t any = 0;
  for (int i = 0; i < kWordsPerCube; ++i) any |= mask.word[i];
  return any == 0;
}

/// A subset of a cube's cells: the free cells, or the cells with surfaces.
struct CubeMask {
  Vec3i key;
  CellMask cells;
};

/// Edge lengths, in voxels, of a cell of 1 << cell_log2 voxels and of a cube of such cells.
DTSDF_HD int32_t cellSide(int32_t cell_log2) { return 1 << cell_log2; }
DTSDF_HD int32_t cubeSideInVoxels(int32_t cell_log2) { return kCubeSide << cell_log2; }

/// Arithmetic shifts round towards minus infinity.
DTSDF_HD Vec3i shiftDown(const Vec3i& a, int bits) {
  return {a.x >> bits, a.y >> bits, a.z >> bits};
}
DTSDF_HD Vec3i cubeOfCell(const Vec3i& cell) { return shiftDown(cell, kCubeSideLog2); }
DTSDF_HD int indexInCube(const Vec3i& cell) {
  constexpr int32_t kMask = kCubeSide - 1;
  return cellIndex(cell.x & kMask, cell.y & kMask, cell.z & kMask);
}
DTSDF_HD Vec3i firstCellOfCube(const Vec3i& cube) {
  return {cube.x * kCubeSide, cube.y * kCubeSide, cube.z * kCubeSide};
}

/// A sector contains 32 x 32 x 32 cells, whose distances are computed together. Cells around it, up
/// to the maximum distance, are read as well; the larger the sector, the smaller this overhead.
constexpr int kSectorSideLog2 = 5;
constexpr int kSectorSide = 1 << kSectorSideLog2;  ///< In cells.
constexpr int kCubesAlong = kSectorSide / kCubeSide;
constexpr int kCubesPerSector = kCubesAlong * kCubesAlong * kCubesAlong;
constexpr int kCellsPerSector = kCubesPerSector * kCellsPerCube;

DTSDF_HD Vec3i sectorOfCell(const Vec3i& cell) { return shiftDown(cell, kSectorSideLog2); }
DTSDF_HD Vec3i sectorOfCube(const Vec3i& cube) {
  return shiftDown(cube, kSectorSideLog2 - kCubeSideLog2);
}

/// Index of a cube in its sector.
DTSDF_HD int cubeInSector(const Vec3i& cube) {
  constexpr int32_t kMask = kCubesAlong - 1;
  return (cube.x & kMask) + kCubesAlong * ((cube.y & kMask) + kCubesAlong * (cube.z & kMask));
}

/// The cube at index `number` in a sector.
DTSDF_HD Vec3i cubeOfSector(const Vec3i& sector, int number) {
  return {sector.x * kCubesAlong + number % kCubesAlong,
          sector.y * kCubesAlong + number / kCubesAlong % kCubesAlong,
          sector.z * kCubesAlong + number / (kCubesAlong * kCubesAlong)};
}

}  // namespace dtsdf
