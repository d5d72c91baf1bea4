/// Computes squared distances from cells to the nearest cell with a surface, up to a maximum
/// distance, as minima along x, then y, then z (Saito and Toriwaki, Pattern Recognition 27, 1994).
/// The distances are integers, so the order of computation does not matter.
#pragma once

#include "kernels/space/cells.h"

namespace dtsdf {

/// Stored as the squared distance if no surface lies within the maximum distance.
constexpr uint16_t kSquaredFar = 0xffff;

/// The cubes of a sector that have surfaces. Each sets bit cubeInSector() in `known`. `first` is
/// the index of the first cube's mask in DistanceTask::cubes, where the masks of the other cubes
/// follow in the order of their bits.
struct SurfaceCubes {
  uint64_t known;
  int32_t first;
};

/// Adjacent sectors along z whose distances are computed together.
struct SectorStack {
  int32_t count;
  int32_t place;  ///< Index of its first sector in DistanceTask::places.
  int32_t first;  ///< Index of its first sector among the sectors of all stacks.
  /// Index of its first plane of cells among the planes of all stacks. A stack includes the planes
  /// up to `reach` cells above and below its sectors.
  int32_t first_plane;
};

/// Sectors whose distances are to be computed, and the surfaces in a box around them.
struct DistanceTask {
  int32_t reach;  ///< Maximum distance, in cells; at most 255.
  int32_t stack_count, place_count, sector_count, cube_count;
  int32_t box_x, box_y;  ///< Number of sectors along the box's edges.
  int32_t wanted;        ///< Number of sectors in all stacks.
  int32_t plane_count;   ///< Number of planes in all stacks.
  int32_t max_planes;    ///< Maximum number of planes in a stack.
  const SectorStack* stacks;
  /// Indices into `sectors` for the sectors of the box, x fastest; -1 for those without surfaces.
  const int32_t* places;
  const SurfaceCubes* sectors;
  const CellMask* cubes;
};

/// Number of sectors on each side that lie within the maximum distance.
DTSDF_HD int32_t sectorsInReach(int32_t reach) {
  return (reach + kSectorSide - 1) >> kSectorSideLog2;
}
DTSDF_HD int32_t windowSide(int32_t reach) { return 2 * sectorsInReach(reach) + 1; }
DTSDF_HD int32_t planesOf(int32_t sectors, int32_t reach) {
  return kSectorSide * sectors + 2 * reach;
}

DTSDF_HD int countBits(uint64_t bits) {
#ifdef __CUDA_ARCH__
  return __popcll(bits);
#else
  return __builtin_popcountll(bits);
#endif
}
/// @pre At least one bit is set.
DTSDF_HD int lowestBit(uint32_t bits) {
#ifdef __CUDA_ARCH__
  return __ffs(static_cast<int>(bits)) - 1;
#else
  return __builtin_ctz(bits);
#endif
}
DTSDF_HD int highestBit(uint32_t bits) {
#ifdef __CUDA_ARCH__
  return 31 - __clz(static_cast<int>(bits));
#else
  return 31 - __builtin_clz(bits);
#endif
}

/// The cells with surfaces in a row of 32 cells along x, one bit each. Its y and z coordinates are
/// relative to the stack's first cell; along x, it is in the i-th of the windowSide() sectors
/// around the stack.
DTSDF_HD uint32_t surfacesInRow(const DistanceTask& task, const SectorStack& stack, int32_t i,
                                int32_t y, int32_t z) {
  const int32_t rows = (y >> kSectorSideLog2) + task.box_y * (z >> kSectorSideLog2);
  const int32_t place =
      task.places[stack.place + i - sectorsInReach(task.reach) + task.box_x * rows];
  if (place < 0) return 0;
  const SurfaceCubes& sector = task.sectors[place];
  const int first = cubeInSector(cubeOfCell({0, y, z}));
  const auto some = static_cast<uint32_t>(sector.known >> first & ((1u << kCubesAlong) - 1));
  if (some == 0) return 0;
  const CellMask* cube =
      task.cubes + sector.first + countBits(sector.known & ((uint64_t{1} << first) - 1));
  const int shift = kCubeSide * (y & (kCubeSide - 1));
  uint32_t row = 0;
  for (int n = 0; n < kCubesAlong; ++n) {
    if ((some >> n & 1u) == 0) continue;
    row |= static_cast<uint32_t>(cube->word[z & (kCubeSide - 1)] >> shift & 0xffu) << (8 * n);
    ++cube;
  }
  return row;
}

/// The squared distance along a row to the nearest surface, from cell x of the middle word;
/// kSquaredFar if none is at most `reach` cells away.
DTSDF_HD int32_t squaredAlongRow(const uint32_t* words, int32_t x, int32_t reach) {
  const int32_t ring = sectorsInReach(reach);
  const uint32_t from = words[ring] >> x, until = words[ring] << (kSectorSide - 1 - x);
  int32_t above = from != 0 ? lowestBit(from) : reach + 1;
  int32_t below = until != 0 ? kSectorSide - 1 - highestBit(until) : reach + 1;
  for (int32_t i = 1; from == 0 && i <= ring; ++i) {
    if (words[ring + i] == 0) continue;
    above = kSectorSide * i - x + lowestBit(words[ring + i]);
    break;
  }
  for (int32_t i = 1; until == 0 && i <= ring; ++i) {
    if (words[ring - i] == 0) continue;
    below = x + kSectorSide * i - highestBit(words[ring - i]);
    break;
  }
  const int32_t least = above < below ? above : below;
  return least <= reach ? least * least : kSquaredFar;
}

/// `squared`, or kSquaredFar if it exceeds the square of `reach`.
DTSDF_HD uint16_t squaredWithin(int32_t squared, int32_t reach) {
  return squared <= reach * reach ? static_cast<uint16_t>(squared) : kSquaredFar;
}

}  // namespace dtsdf
