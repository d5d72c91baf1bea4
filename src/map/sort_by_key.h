/// Sorts a frame's block requests by packed key. Few passes are needed, since the blocks of a frame
/// are close together.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "kernels/core/grid.h"

namespace dtsdf {

/// Radix sort of numbers below 2^bits, each stored in the bits above a 32-bit payload.
inline void sortByDigits(std::vector<uint64_t>& numbers, int bits) {
  constexpr int kDigitBits = 8, kBelow = 32;
  constexpr uint64_t kMask = (1u << kDigitBits) - 1u;
  std::vector<uint64_t> sorted(numbers.size());
  for (int shift = kBelow; shift < kBelow + bits; shift += kDigitBits) {
    uint32_t first[kMask + 1] = {};
    for (const uint64_t number : numbers) ++first[number >> shift & kMask];
    uint32_t before = 0;
    for (uint32_t& place : first) before += std::exchange(place, before);
    for (const uint64_t number : numbers) sorted[first[number >> shift & kMask]++] = number;
    numbers.swap(sorted);
  }
}

/// Stable sort of records by their `key`. Packed keys are first shortened to coordinates relative
/// to the smallest ones, in as few bits as possible. Short lists and widely spread keys are sorted
/// by comparison.
template <class Record>
void sortByKey(std::vector<Record>& records) {
  constexpr size_t kFew = 32;
  constexpr int kMaxBits = 32;
  BlockKey least{kMaxBlockCoordinate, kMaxBlockCoordinate, kMaxBlockCoordinate};
  BlockKey most{-kMaxBlockCoordinate, -kMaxBlockCoordinate, -kMaxBlockCoordinate};
  for (const Record& record : records) {
    least = minOf(least, unpackKey(record.key));
    most = maxOf(most, unpackKey(record.key));
  }
  const auto bitsFor = [](int32_t greatest) {
    return greatest <= 0 ? 0 : 32 - __builtin_clz(static_cast<uint32_t>(greatest));
  };
  const int bits_x = bitsFor(most.x - least.x), bits_y = bitsFor(most.y - least.y);
  const int bits = bits_x + bits_y + bitsFor(most.z - least.z);
  if (records.size() < kFew || bits > kMaxBits) {
    std::stable_sort(records.begin(), records.end(),
                     [](const Record& a, const Record& b) { return a.key < b.key; });
    return;
  }
  std::vector<uint64_t> numbers;
  numbers.reserve(records.size());
  for (const Record& record : records) {
    const BlockKey at = unpackKey(record.key) - least;
    const auto number = (static_cast<uint64_t>(at.z) << bits_y | static_cast<uint64_t>(at.y))
                            << bits_x |
                        static_cast<uint64_t>(at.x);
    numbers.push_back(number << 32 | numbers.size());
  }
  sortByDigits(numbers, bits);
  std::vector<Record> sorted;
  sorted.reserve(records.size());
  for (const uint64_t number : numbers) sorted.push_back(records[static_cast<uint32_t>(number)]);
  records.swap(sorted);
}

}  // namespace dtsdf
