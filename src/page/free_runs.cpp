#include "page/free_runs.h"

namespace dtsdf {

void FreeRuns::insert(uint64_t first, uint64_t length) {
  free_.emplace(first, length);
  by_length_.emplace(length, first);
}

void FreeRuns::erase(uint64_t first, uint64_t length) {
  free_.erase(first);
  by_length_.erase({length, first});
}

std::optional<uint64_t> FreeRuns::take(uint64_t units) {
  const auto shortest = by_length_.lower_bound({units, 0});
  uint64_t first = end_;
  if (shortest != by_length_.end()) {
    const uint64_t length = shortest->first;
    first = shortest->second;
    erase(first, length);
    if (length > units) insert(first + units, length - units);
  } else {
    if (end_ + units > most_units_) return std::nullopt;
    end_ += units;
  }
  in_use_ += units;
  return first;
}

void FreeRuns::give(uint64_t first, uint64_t units) {
  in_use_ -= units;
  uint64_t last = first + units;
  const auto next = free_.lower_bound(last);
  if (next != free_.end() && next->first == last) {
    last += next->second;
    erase(next->first, next->second);
  }
  const auto after = free_.lower_bound(first);
  if (after != free_.begin()) {
    const auto [before, length] = *std::prev(after);
    if (before + length == first) {
      first = before;
      erase(before, length);
    }
  }
  if (last == end_) {
    end_ = first;
  } else {
    insert(first, last - first);
  }
}

/// A run is a node in each of both trees.
size_t FreeRuns::bytes() const {
  constexpr size_t kNodeBytes = 4 * sizeof(void*) + 2 * sizeof(uint64_t) + sizeof(size_t);
  return 2 * kNodeBytes * free_.size();
}

}  // namespace dtsdf
