#include "page/free_runs.h"

#include <iterator>
#include <new>

namespace dtsdf {

void FreeRuns::erase(std::map<uint64_t, uint64_t>::iterator run) {
  by_length_.erase({run->second, run->first});
  free_.erase(run);
}

/// Without memory to note the rest of a longer run, that stays in use.
std::optional<uint64_t> FreeRuns::take(uint64_t units) {
  const auto shortest = by_length_.lower_bound({units, 0});
  if (shortest == by_length_.end()) {
    if (end_ + units > most_units_) return std::nullopt;
    in_use_ += units;
    end_ += units;
    return end_ - units;
  }
  const auto [length, first] = *shortest;
  erase(free_.find(first));
  in_use_ += length;
  if (length > units) give(first + units, length - units);
  return first;
}

void FreeRuns::give(uint64_t first, uint64_t units) noexcept {
  uint64_t begin = first, end = first + units;
  auto after = free_.lower_bound(first);
  if (after != free_.end() && after->first == end) {
    end += after->second;
    erase(after++);
  }
  if (after != free_.begin()) {
    const auto before = std::prev(after);
    if (before->first + before->second == first) {
      begin = before->first;
      erase(before);
    }
  }
  in_use_ -= units;
  if (end == end_) {
    end_ = begin;
    return;
  }
  try {
    by_length_.emplace(end - begin, begin);
    free_.emplace(begin, end - begin);
  } catch (const std::bad_alloc&) {
    by_length_.erase({end - begin, begin});
    in_use_ += end - begin;
  }
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
