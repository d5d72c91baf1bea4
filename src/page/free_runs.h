/// Which units of a file are free: runs of them are taken and given back, and the file grows where
/// none is long enough. The shortest that is long enough is taken, the first one of those.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <utility>

namespace dtsdf {

class FreeRuns {
 public:
  /// @param most_units That the file may have.
  explicit FreeRuns(uint64_t most_units) : most_units_(most_units) {}

  /// The first unit of a run that is free no longer; none where the file would get too long.
  /// Without memory to note the rest of a longer run, that stays in use.
  std::optional<uint64_t> take(uint64_t units) {
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

  /// Without memory to note it, the run stays in use until clear(). @pre It was taken.
  void give(uint64_t first, uint64_t units) noexcept {
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

  /// Gives all back.
  void clear() noexcept {
    free_.clear();
    by_length_.clear();
    end_ = in_use_ = 0;
  }

  uint64_t inUse() const { return in_use_; }
  uint64_t end() const { return end_; }  ///< Units that the file has.
  /// About what it takes of memory: a run is a node in each of both trees.
  size_t bytes() const {
    constexpr size_t kNodeBytes = 4 * sizeof(void*) + 2 * sizeof(uint64_t) + sizeof(size_t);
    return 2 * kNodeBytes * free_.size();
  }

 private:
  void erase(std::map<uint64_t, uint64_t>::iterator run) {
    by_length_.erase({run->second, run->first});
    free_.erase(run);
  }

  const uint64_t most_units_;
  std::map<uint64_t, uint64_t> free_;  ///< Lengths of free runs by their first units; none touch.
  std::set<std::pair<uint64_t, uint64_t>> by_length_;  ///< Free runs as (length, first unit).
  uint64_t end_ = 0, in_use_ = 0;
};

}  // namespace dtsdf
