/// Maps that are one box of a larger one, as `reconstruct --only` makes them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "dtsdf_mapping/geometry.h"

namespace dtsdf {

/// Numbers from the first up to and with the last of each range, rising.
using IndexRanges = std::vector<std::pair<uint64_t, uint64_t>>;

struct MapBox {
  BlockKey first, last;           ///< Blocks from the one up to and with the other on each axis.
  uint64_t recordings = 1;        ///< That it was made from, one after the other.
  IndexRanges fused, supporting;  ///< Frames that were fused into it, and those that touched a
                                  ///< block of the larger map: see frameNumber().
};

/// What its record holds, for its writer and its reader.
template <class Io>
void fields(Io& io, MapBox& box) {
  io(box.first, box.last, box.recordings);
  for (IndexRanges* const frames : {&box.fused, &box.supporting}) {
    uint64_t count = frames->size();
    io(count);
    for (uint64_t i = 0; i < count; ++i) {
      if (i == frames->size()) frames->emplace_back();
      io((*frames)[i].first, (*frames)[i].second);
    }
  }
}

/// The number of a frame of the recording that is read last, by its place there.
inline uint64_t frameNumber(const MapBox& box, uint64_t index) {
  return ((box.recordings - 1) << 40) + index;
}

/// Appends a number that is above those before it.
inline void appendIndex(uint64_t index, IndexRanges& ranges) {
  if (!ranges.empty() && index == ranges.back().second + 1) {
    ranges.back().second = index;
  } else {
    ranges.emplace_back(index, index);
  }
}

/// How many numbers are in any of them.
inline uint64_t countOfUnion(IndexRanges ranges) {
  std::sort(ranges.begin(), ranges.end());
  uint64_t count = 0, next = 0;  // the first number that is not counted yet
  for (const auto& [first, last] : ranges) {
    if (last < next) continue;
    count += last + 1 - std::max(first, next);
    next = last + 1;
  }
  return count;
}

}  // namespace dtsdf
