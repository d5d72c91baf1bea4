/// The colour of a surface at one voxel.
#pragma once

#include <cstdint>
#include <cstring>

#include "kernels/core/grid.h"

namespace dtsdf {

/// A colour, encoded as in the colour images, and its weight. Aligned so that it is copied as one
/// word.
struct alignas(4) VoxelColour {
  uint8_t red, green, blue;
  uint8_t weight;  ///< Encoded; see colourWeight(). 0 if not painted.
};

/// Colours are stored in bricks of 4 x 4 x 4 voxels, as a surface passes through only about half of
/// a voxel array's bricks.
constexpr int kBricksPerArray = 8, kBrickSide = kBlockSide / 2;
constexpr int kVoxelsPerBrick = kVoxelsPerBlock / kBricksPerArray;

/// The index of a voxel's brick in its array, and the voxel's index in the brick; x varies fastest
/// in both.
DTSDF_HD int brickOf(int voxel) { return (voxel >> 2 & 1) | (voxel >> 4 & 2) | (voxel >> 6 & 4); }
DTSDF_HD int placeInBrick(int voxel) { return (voxel & 3) | (voxel >> 1 & 12) | (voxel >> 2 & 48); }
DTSDF_HD int voxelInBrick(int brick, int place) {
  return (place & 3) | (place & 12) << 1 | (place & 48) << 2 | (brick & 1) << 2 | (brick & 2) << 4 |
         (brick & 4) << 6;
}

/// Bit of the brick that holds a voxel in a direction: one of 48 per block.
DTSDF_HD uint64_t brickBit(int direction, int voxel) {
  return uint64_t{1} << (kBricksPerArray * direction + brickOf(voxel));
}

/// Weights above 2^-12 and up to 15.5 are stored in eight bits: four bits of exponent, and the
/// highest four bits of a float's fraction.
constexpr uint32_t kColourWeightBits = 19;         // low bits of the float that are dropped
constexpr uint32_t kColourWeightZero = 115u << 4;  // upper bits of 2^-12, which counts as 0
constexpr uint32_t kMaxColourWeightCode = 255;

/// Decodes a weight.
DTSDF_HD float colourWeight(uint8_t code) {
  if (code == 0) return 0.0f;
  const uint32_t bits = (code + kColourWeightZero) << kColourWeightBits;
  float weight;
  memcpy(&weight, &bits, sizeof(weight));
  return weight;
}

/// Encodes a positive weight as the nearest code, but never as 0, which means "not painted".
DTSDF_HD uint8_t colourWeightCode(float weight) {
  uint32_t bits;
  memcpy(&bits, &weight, sizeof(bits));
  const uint32_t rounded = (bits + (1u << (kColourWeightBits - 1))) >> kColourWeightBits;
  if (rounded <= kColourWeightZero) return 1;
  const uint32_t code = rounded - kColourWeightZero;
  return static_cast<uint8_t>(code < kMaxColourWeightCode ? code : kMaxColourWeightCode);
}

DTSDF_HD bool isPainted(const VoxelColour& colour) { return colour.weight != 0; }

/// Whether two colours look different in a mesh.
DTSDF_HD bool looksDifferent(const VoxelColour& a, const VoxelColour& b) {
  return a.red != b.red || a.green != b.green || a.blue != b.blue || isPainted(a) != isPainted(b);
}

}  // namespace dtsdf
