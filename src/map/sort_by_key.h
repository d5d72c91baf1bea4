/// Sorts what a frame asks for by the packed key of its block: in a few passes, since the blocks
/// of a frame lie near each other.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "kernels/core/grid.h"

namespace dtsdf {

/// Packed keys as small numbers in the same order: the coordinates from the least ones on, in no
/// more bits than they need.
class KeyRange {
 public:
  template <class Record>
  explicit KeyRange(const std::vector<Record>& records) {
    for (const Record& record : records) {
      const BlockKey key = unpackKey(record.key);
      least_ = leastOf(least_, key);
      most_ = greatestOf(most_, key);
    }
    bits_x_ = bitsFor(most_.x - least_.x);
    bits_y_ = bitsFor(most_.y - least_.y);
    bits_ = bits_x_ + bits_y_ + bitsFor(most_.z - least_.z);
  }

  int bits() const { return bits_; }  ///< Of the greatest number, at most.

  uint64_t numberOf(PackedKey packed) const {
    const BlockKey key = unpackKey(packed);
    const auto from = [](int32_t at, int32_t least) { return static_cast<uint64_t>(at - least); };
    return (from(key.z, least_.z) << bits_y_ | from(key.y, least_.y)) << bits_x_ |
           from(key.x, least_.x);
  }

 private:
  static int bitsFor(int32_t greatest) {
    return greatest <= 0 ? 0 : 32 - __builtin_clz(static_cast<uint32_t>(greatest));
  }

  BlockKey least_ = {kMaxBlockCoordinate, kMaxBlockCoordinate, kMaxBlockCoordinate};
  BlockKey most_ = {-kMaxBlockCoordinate, -kMaxBlockCoordinate, -kMaxBlockCoordinate};
  int bits_x_ = 0, bits_y_ = 0, bits_ = 0;
};

/// Sorts numbers below 2^bits, each with 32 bits below it that go along, digit by digit.
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

/// Sorts records by their `key`; those of one key stay in their order.
template <class Record>
void sortByKey(std::vector<Record>& records) {
  constexpr size_t kFew = 32;
  constexpr int kMostBits = 32;
  const KeyRange range(records);
  if (records.size() < kFew || range.bits() > kMostBits) {
    std::stable_sort(records.begin(), records.end(),
                     [](const Record& a, const Record& b) { return a.key < b.key; });
    return;
  }
  std::vector<uint64_t> numbers;
  numbers.reserve(records.size());
  for (const Record& record : records) {
    numbers.push_back(range.numberOf(record.key) << 32 | numbers.size());
  }
  sortByDigits(numbers, range.bits());
  std::vector<Record> sorted;
  sorted.reserve(records.size());
  for (const uint64_t number : numbers) sorted.push_back(records[static_cast<uint32_t>(number)]);
  records.swap(sorted);
}

}  // namespace dtsdf
