/// Describes a map that is one box of a larger map, as built by `reconstruct --only`.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "dtsdf_mapping/geometry.h"

namespace dtsdf {

/// Ranges of numbers in ascending order, each given by its first and last number.
using IndexRanges = std::vector<std::pair<uint64_t, uint64_t>>;

struct MapBox {
  BlockKey first, last;           ///< Blocks at the box's lower and upper corners.
  uint64_t recordings = 1;        ///< Number of recordings that were fused one after another.
  IndexRanges fused, supporting;  ///< The frameNumber() of each frame fused into the box, and of
                                  ///< each frame that touched any block of the larger map.
};

/// Reads or writes the content of a `BOX ` record.
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

/// The number of the frame with this index in the newest recording.
inline uint64_t frameNumber(const MapBox& box, uint64_t index) {
  return ((box.recordings - 1) << 40) + index;
}

/// Appends a number that is larger than all in `ranges`.
inline void appendIndex(uint64_t index, IndexRanges& ranges) {
  if (!ranges.empty() && index == ranges.back().second + 1) {
    ranges.back().second = index;
  } else {
    ranges.emplace_back(index, index);
  }
}

/// Counts the numbers that are in at least one range.
inline uint64_t countOfUnion(IndexRanges ranges) {
  std::sort(ranges.begin(), ranges.end());
  uint64_t count = 0, next = 0;  // next: the smallest number that is not counted yet
  for (const auto& [first, last] : ranges) {
    if (last < next) continue;
    count += last + 1 - std::max(first, next);
    next = last + 1;
  }
  return count;
}

}  // namespace dtsdf
