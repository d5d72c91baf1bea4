/// The window of loose_pieces.h as words, whose units grow side by side on the CPU: a bit for each
/// unit, 16 to a row along x, and four rows along y to a word.
#pragma once

#include "kernels/meshing/loose_pieces.h"

namespace dtsdf {

constexpr int kRowsPerWord = 64 / kWindowSide;
constexpr int kWordsPerLayer = kWindowSide / kRowsPerWord;
constexpr int kWindowWords = kWindowRows / kRowsPerWord;

/// The word of a unit, given from the block's first one; its bit there; and back.
inline int windowWord(const Vec3i& unit) { return windowRow(unit.y, unit.z) / kRowsPerWord; }
inline uint64_t windowBit(const Vec3i& unit) {
  const int row = windowRow(unit.y, unit.z) % kRowsPerWord;
  return uint64_t{1} << (kWindowSide * row + unit.x + kMostLooseUnits);
}
inline Vec3i windowUnit(int word, int bit) {
  return firstOfRow(kRowsPerWord * word + bit / kWindowSide) + gridStep(0, bit % kWindowSide);
}

/// The units of a word, and those beside them along x; and along y, with the words before and after
/// it, which are 0 outside of the window.
inline uint64_t grownAlongX(uint64_t word) {
  constexpr uint64_t kFirstOfRows = 0x0001000100010001u;
  return word | (word << 1 & ~kFirstOfRows) | (word >> 1 & ~(kFirstOfRows << (kWindowSide - 1)));
}
inline uint64_t grownAlongY(uint64_t word, uint64_t before, uint64_t after) {
  constexpr int kToLastRow = 64 - kWindowSide;
  return word | word << kWindowSide | word >> kWindowSide | before >> kToLastRow |
         after << kToLastRow;
}

/// The part of a shadow that a word throws.
inline Shadow shadowOfWord(uint64_t word, int number) {
  const uint64_t halves = word | word >> 32;
  uint32_t rows = 0;
  for (int row = 0; row < kRowsPerWord; ++row) {
    rows |= (word >> (kWindowSide * row) & 0xffffu) != 0 ? 1u << row : 0u;
  }
  return {static_cast<uint32_t>((halves | halves >> 16) & 0xffffu),
          rows << (kRowsPerWord * (number % kWordsPerLayer)),
          word != 0 ? 1u << (number / kWordsPerLayer) : 0u};
}

}  // namespace dtsdf
