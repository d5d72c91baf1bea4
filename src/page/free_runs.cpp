#include "page/free_runs.h"

#include <new>

namespace dtsdf {

/// @return whether there was memory for it; else nothing has changed.
bool FreeRuns::insert(uint64_t first, uint64_t length) try {
  const auto run = free_.emplace(first, length).first;
  try {
    by_length_.emplace(length, first);
  } catch (const std::bad_alloc&) {
    free_.erase(run);
    return false;
  }
  return true;
} catch (const std::bad_alloc&) {
  return false;
}

/// Takes no memory.
void FreeRuns::move(Free::iterator run, uint64_t first, uint64_t length) {
  auto by_length = by_length_.extract({run->second, run->first});
  auto by_first = free_.extract(run);
  by_length.value() = {length, first};
  by_first.key() = first;
  by_first.mapped() = length;
  by_length_.insert(std::move(by_length));
  free_.insert(std::move(by_first));
}

void FreeRuns::erase(Free::iterator run) {
  by_length_.erase({run->second, run->first});
  free_.erase(run);
}

std::optional<uint64_t> FreeRuns::take(uint64_t units) noexcept {
  const auto shortest = by_length_.lower_bound({units, 0});
  uint64_t first = end_;
  if (shortest != by_length_.end()) {
    const uint64_t length = shortest->first;
    first = shortest->second;
    const auto run = free_.find(first);
    if (length > units) {
      move(run, first + units, length - units);
    } else {
      erase(run);
    }
  } else {
    if (end_ + units > most_units_) return std::nullopt;
    end_ += units;
  }
  in_use_ += units;
  return first;
}

void FreeRuns::give(uint64_t first, uint64_t units) noexcept {
  uint64_t last = first + units;
  const auto after = free_.lower_bound(first);
  const bool joins_after = after != free_.end() && after->first == last;
  const auto before = after == free_.begin() ? free_.end() : std::prev(after);
  const bool joins_before = before != free_.end() && before->first + before->second == first;
  if (joins_after) last += after->second;
  if (joins_before) first = before->first;
  if (last == end_) {
    end_ = first;
    if (joins_after) erase(after);
    if (joins_before) erase(before);
  } else if (joins_before) {
    if (joins_after) erase(after);
    move(before, first, last - first);
  } else if (joins_after) {
    move(after, first, last - first);
  } else if (!insert(first, last - first)) {
    return;
  }
  in_use_ -= units;
}

void FreeRuns::clear() noexcept {
  free_.clear();
  by_length_.clear();
  end_ = in_use_ = 0;
}

/// A run is a node in each of both trees.
size_t FreeRuns::bytes() const {
  constexpr size_t kNodeBytes = 4 * sizeof(void*) + 2 * sizeof(uint64_t) + sizeof(size_t);
  return 2 * kNodeBytes * free_.size();
}

}  // namespace dtsdf
