/// Sets of mesh units, of a block or of the window around it, that the lanes of a warp hold
/// together: a bit for each unit. For .cu files.
#pragma once

#include "kernels/meshing/loose_pieces.h"

namespace dtsdf {
namespace gpu {

/// The units of a block, of which each of the first 16 lanes of a warp has four rows. What follows
/// is by all lanes of a warp.
struct BlockPart {
  uint32_t rows;
};

/// The units of a window, of which each lane has two words.
struct WindowPart {
  uint64_t word[2];
};
static_assert(kWindowWords == 64 && kWordsPerLayer == 4, "two lanes have a layer");

__device__ inline BlockPart operator&(const BlockPart& a, const BlockPart& b) {
  return {a.rows & b.rows};
}
__device__ inline BlockPart operator|(const BlockPart& a, const BlockPart& b) {
  return {a.rows | b.rows};
}
__device__ inline BlockPart without(const BlockPart& a, const BlockPart& b) {
  return {a.rows & ~b.rows};
}
__device__ inline bool hasUnits(const BlockPart& part) { return part.rows != 0; }

__device__ inline WindowPart operator&(const WindowPart& a, const WindowPart& b) {
  return {{a.word[0] & b.word[0], a.word[1] & b.word[1]}};
}
__device__ inline WindowPart operator|(const WindowPart& a, const WindowPart& b) {
  return {{a.word[0] | b.word[0], a.word[1] | b.word[1]}};
}
__device__ inline WindowPart without(const WindowPart& a, const WindowPart& b) {
  return {{a.word[0] & ~b.word[0], a.word[1] & ~b.word[1]}};
}
__device__ inline bool hasUnits(const WindowPart& part) {
  return (part.word[0] | part.word[1]) != 0;
}

template <class Part>
__device__ bool isAny(const Part& units) {
  return __any_sync(~0u, hasUnits(units)) != 0;
}

/// The lowest unit of a lane.
__device__ inline BlockPart lowest(const BlockPart& part) { return {part.rows & (0 - part.rows)}; }
__device__ inline WindowPart lowest(const WindowPart& part) {
  const uint64_t first = part.word[0] & (0 - part.word[0]);
  return {{first, first != 0 ? 0 : part.word[1] & (0 - part.word[1])}};
}

/// The units that are among some or share a face with one; none outside of the block.
__device__ inline BlockPart grown(const BlockPart& units, int lane) {
  constexpr uint32_t kFirstOfRows = 0x01010101u;
  constexpr int kToLastRow = 32 - kBlockSide;
  const uint32_t own = units.rows, beside = __shfl_xor_sync(~0u, own, 1);
  const uint32_t along_x =
      (own << 1 & ~kFirstOfRows) | (own >> 1 & ~(kFirstOfRows << (kBlockSide - 1)));
  const uint32_t along_y = own << kBlockSide | own >> kBlockSide |
                           (lane % 2 != 0 ? beside >> kToLastRow : beside << kToLastRow);
  // The lanes beyond have none, and the first ones get their own.
  const uint32_t along_z = __shfl_up_sync(~0u, own, 2) | __shfl_down_sync(~0u, own, 2);
  return {own | along_x | along_y | along_z};
}

__device__ inline WindowPart grownAlongX(const WindowPart& units) {
  return {{dtsdf::grownAlongX(units.word[0]), dtsdf::grownAlongX(units.word[1])}};
}

__device__ inline WindowPart grownAlongY(const WindowPart& units, int lane) {
  const bool is_upper_half = lane % 2 != 0;
  const uint64_t before = __shfl_up_sync(~0u, units.word[1], 1);
  const uint64_t after = __shfl_down_sync(~0u, units.word[0], 1);
  return {{dtsdf::grownAlongY(units.word[0], is_upper_half ? before : 0, units.word[1]),
           dtsdf::grownAlongY(units.word[1], units.word[0], is_upper_half ? 0 : after)}};
}

/// The outermost lanes get their own.
__device__ inline WindowPart grownAlongZ(const WindowPart& units) {
  WindowPart result = units;
#pragma unroll
  for (uint64_t& word : result.word) {
    word |= __shfl_up_sync(~0u, word, 2) | __shfl_down_sync(~0u, word, 2);
  }
  return result;
}

__device__ inline WindowPart grown(const WindowPart& units, int lane) {
  return grownAlongX(units) | grownAlongY(units, lane) | grownAlongZ(units);
}

__device__ inline uint32_t orOfWarp(uint32_t bits) {
#if __CUDA_ARCH__ >= 800
  return __reduce_or_sync(~0u, bits);
#else
#pragma unroll
  for (int lanes = 16; lanes > 0; lanes /= 2) bits |= __shfl_xor_sync(~0u, bits, lanes);
  return bits;
#endif
}

/// Of a block, as if nothing were around it.
__device__ inline bool isSmall(const BlockPart& piece, int most_units, int lane) {
  uint32_t shadow = 0;
#pragma unroll
  for (int row = 0; row < kRowsPerWord; ++row) {
    const uint32_t units = piece.rows >> (kBlockSide * row) & 0xffu;
    shadow |= units | (units != 0 ? 0x100u << (kRowsPerWord * (lane % 2) + row) : 0);
  }
  shadow = orOfWarp(shadow | (piece.rows != 0 ? 0x10000u << (lane / 2) : 0));
  return dtsdf::isSmall({shadow & 0xffu, shadow >> 8 & 0xffu, shadow >> 16}, most_units);
}

__device__ inline bool isSmall(const WindowPart& piece, int most_units, int lane) {
  const Shadow first = shadowOfWord(piece.word[0], 2 * lane);
  const Shadow second = shadowOfWord(piece.word[1], 2 * lane + 1);
  const uint32_t xy = orOfWarp(first.x | second.x | (first.y | second.y) << kWindowSide);
  return dtsdf::isSmall({xy & 0xffffu, xy >> kWindowSide, orOfWarp(first.z | second.z)},
                        most_units);
}

/// Units of a block, in its window and taken from there, where they are of so many lanes later.
constexpr int kFirstOwnLane = 2 * kMostLooseUnits;

__device__ inline WindowPart toWindow(const BlockPart& part, int lane) {
  const uint32_t rows = __shfl_sync(~0u, part.rows, (lane - kFirstOwnLane) & 31);
  uint64_t word = 0;
#pragma unroll
  for (int row = 0; row < kRowsPerWord; ++row) {
    word |= static_cast<uint64_t>(rows >> (kBlockSide * row) & 0xffu)
            << (kWindowSide * row + kMostLooseUnits);
  }
  return {{lane % 2 != 0 ? word : 0, lane % 2 != 0 ? 0 : word}};
}

__device__ inline BlockPart toBlock(const WindowPart& part, int lane) {
  const uint64_t word = part.word[lane % 2 != 0 ? 0 : 1] >> kMostLooseUnits;
  uint32_t rows = 0;
#pragma unroll
  for (int row = 0; row < kRowsPerWord; ++row) {
    rows |= static_cast<uint32_t>(word >> (kWindowSide * row) & 0xffu) << (kBlockSide * row);
  }
  return {__shfl_sync(~0u, rows, (lane + kFirstOwnLane) & 31)};
}

}  // namespace gpu
}  // namespace dtsdf
