/// Bits for the voxels and mesh units of a block: what rays have to know of a unit before anything
/// is made of its voxels.
///
/// A unit with a corner that is known in no direction is unknown (kernels/render/ray_unit.h); one
/// with known corners, none of which is behind a surface in some direction, lies in front. Only the
/// others have to be made.
#pragma once

#include "kernels/core/grid.h"

namespace dtsdf {

/// A bit for each voxel of a block, or for the unit that begins at it: a word per layer, 8 bits a
/// row.
struct BlockBits {
  uint64_t layer[kBlockSide];
};

/// The bit's place in its layer, wherever the block lies.
DTSDF_HD int bitOf(const Vec3i& voxel) {
  return (voxel.x & (kBlockSide - 1)) + kBlockSide * (voxel.y & (kBlockSide - 1));
}

DTSDF_HD bool has(const BlockBits& bits, const Vec3i& voxel) {
  return (bits.layer[voxel.z & (kBlockSide - 1)] >> bitOf(voxel) & 1) != 0;
}

/// How the bits of a unit's corners are joined.
struct AllOf {
  static DTSDF_HD uint64_t join(uint64_t a, uint64_t b) { return a & b; }
};
struct AnyOf {
  static DTSDF_HD uint64_t join(uint64_t a, uint64_t b) { return a | b; }
};

/// The layers of four blocks side by side, by the corner of a unit that lies there.
struct LayersAround {
  uint64_t of[4];
};

/// Joins each voxel of the first layer with the next ones along x and y.
template <class Operation>
DTSDF_HD uint64_t joinInLayer(const LayersAround& layers) {
  const auto along_x = [](uint64_t layer, uint64_t next) {
    constexpr uint64_t kFirst = 0x0101010101010101u;
    const uint64_t shifted = (layer >> 1 & ~(kFirst << 7)) | (next & kFirst) << 7;
    return Operation::join(layer, shifted);
  };
  constexpr int kRow = kBlockSide, kLastRow = kBlockSide * (kBlockSide - 1);
  const uint64_t here = along_x(layers.of[0], layers.of[1]);
  const uint64_t beyond = along_x(layers.of[2], layers.of[3]);
  return Operation::join(here, here >> kRow | beyond << kLastRow);
}

}  // namespace dtsdf
