/// Finds the loose pieces of a block on the CPU.
#pragma once

#include <array>
#include <cstdint>

#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/loose_pieces.h"

namespace dtsdf {

/// A set of a block's units, with a bit for each and a word for each layer along z.
using BlockBits = std::array<uint64_t, kBlockSide>;

inline bool hasUnit(const BlockBits& bits, const Vec3i& unit) {
  return (bits[unit.z] >> (unit.x + kBlockSide * unit.y) & 1u) != 0;
}
inline void addUnit(BlockBits& bits, const Vec3i& unit) {
  bits[unit.z] |= uint64_t{1} << (unit.x + kBlockSide * unit.y);
}

/// The units of `surface` that belong to loose pieces of at most max_units along each axis.
BlockBits looseUnits(const BlockBits& surface, const LabelNeighbourhood& labels, int max_units);

}  // namespace dtsdf
