/// What the map knows of a surface's colour at one voxel.
#pragma once

#include <cstdint>
#include <cstring>

#include "kernels/core/grid.h"

namespace dtsdf {

/// A colour as images have it, and how well it was seen; code 0: never. Read as a word.
struct alignas(4) VoxelColour {
  uint8_t red, green, blue;
  uint8_t weight;  ///< See colourWeight().
};

/// Colours are kept by bricks of 4 x 4 x 4 voxels: a surface passes through about half of those of
/// a voxel array.
constexpr int kBricksPerArray = 8, kBrickSide = kBlockSide / 2;
constexpr int kVoxelsPerBrick = kVoxelsPerBlock / kBricksPerArray;

/// The brick that a voxel of an array lies in, and where in it; both x fastest.
DTSDF_HD int brickOf(int voxel) { return (voxel >> 2 & 1) | (voxel >> 4 & 2) | (voxel >> 6 & 4); }
DTSDF_HD int placeInBrick(int voxel) { return (voxel & 3) | (voxel >> 1 & 12) | (voxel >> 2 & 48); }
DTSDF_HD int voxelInBrick(int brick, int place) {
  return (place & 3) | (place & 12) << 1 | (place & 48) << 2 | (brick & 1) << 2 | (brick & 2) << 4 |
         (brick & 4) << 6;
}

/// One of 48 bits, for the brick of a voxel of one of a block's directions.
DTSDF_HD uint64_t brickBit(int direction, int voxel) {
  return uint64_t{1} << (kBricksPerArray * direction + brickOf(voxel));
}

/// Weights from 2^-12 to 15.5 in eight bits: four of exponent and four of fraction, those of a
/// float. Good views weigh a thousand times as much as bad ones, so that a step of a sixteenth is
/// worth more than a wider scale.
constexpr uint32_t kColourWeightBits = 19;         // of a float that are left out
constexpr uint32_t kColourWeightZero = 115u << 4;  // the code of 2^-12, which counts as 0
constexpr uint32_t kGreatestColourWeight = 255;

/// The weight that a code stands for.
DTSDF_HD float colourWeight(uint8_t code) {
  if (code == 0) return 0.0f;
  const uint32_t bits = (code + kColourWeightZero) << kColourWeightBits;
  float weight;
  memcpy(&weight, &bits, sizeof(weight));
  return weight;
}

/// The code of a weight above 0: the nearest one, but never that of "not seen".
DTSDF_HD uint8_t colourWeightCode(float weight) {
  uint32_t bits;
  memcpy(&bits, &weight, sizeof(bits));
  const uint32_t rounded = (bits + (1u << (kColourWeightBits - 1))) >> kColourWeightBits;
  if (rounded <= kColourWeightZero) return 1;
  const uint32_t code = rounded - kColourWeightZero;
  return static_cast<uint8_t>(code < kGreatestColourWeight ? code : kGreatestColourWeight);
}

DTSDF_HD bool isPainted(const VoxelColour& colour) { return colour.weight != 0; }

/// Whether a mesh shows a difference.
DTSDF_HD bool looksDifferent(const VoxelColour& a, const VoxelColour& b) {
  return a.red != b.red || a.green != b.green || a.blue != b.blue || isPainted(a) != isPainted(b);
}

}  // namespace dtsdf
