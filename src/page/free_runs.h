/// Allocates space in a file in runs, which consist of consecutive units of equal size. A run is
/// taken from the shortest free run that is long enough (the first, if several are equally short);
/// if there is none, the file grows.
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
  /// @param max_units Maximum length of the file, in units.
  explicit FreeRuns(uint64_t max_units) : max_units_(max_units) {}

  /// Allocates a run. @return the first unit of the run; none if the file would become too long.
  std::optional<uint64_t> take(uint64_t units) {
    const auto shortest = by_length_.lower_bound({units, 0});
    if (shortest == by_length_.end()) {
      if (end_ + units > max_units_) return std::nullopt;
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

  /// Frees a run. If memory runs out, it stays marked as used until clear(). @pre It was allocated
  /// by take().
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

  void clear() noexcept {
    free_.clear();
    by_length_.clear();
    end_ = in_use_ = 0;
  }

  uint64_t inUse() const { return in_use_; }
  /// Approximate memory in bytes: a free run is a node in each of the two trees.
  size_t bytes() const {
    constexpr size_t kNodeBytes = 4 * sizeof(void*) + 2 * sizeof(uint64_t) + sizeof(size_t);
    return 2 * kNodeBytes * free_.size();
  }

 private:
  void erase(std::map<uint64_t, uint64_t>::iterator run) {
    by_length_.erase({run->second, run->first});
    free_.erase(run);
  }

  const uint64_t max_units_;
  std::map<uint64_t, uint64_t> free_;  ///< Lengths of free runs by first unit; no two are adjacent.
  std::set<std::pair<uint64_t, uint64_t>> by_length_;  ///< Free runs as (length, first unit).
  uint64_t end_ = 0, in_use_ = 0;  ///< First unit after the last run; number of units in use.
};

}  // namespace dtsdf
