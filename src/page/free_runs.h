/// Which units of a file are free: runs of them are taken and given back, and the file grows where
/// none is long enough. The shortest that is long enough is taken, the first one of those.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace dtsdf {

class FreeRuns {
 public:
  /// @param most_units That the file may have.
  explicit FreeRuns(uint64_t most_units) : most_units_(most_units) {}

  /// The first unit of a run that is free no longer; none where the file would get too long.
  std::optional<uint64_t> take(uint64_t units);

  /// Without memory to note it, the run stays in use until clear(). @pre It was taken.
  void give(uint64_t first, uint64_t units) noexcept;

  /// Gives all back.
  void clear() noexcept;

  uint64_t inUse() const { return in_use_; }
  uint64_t end() const { return end_; }  ///< Units that the file has.
  size_t bytes() const;                  ///< Of memory, about.

 private:
  void erase(std::map<uint64_t, uint64_t>::iterator run);

  const uint64_t most_units_;
  std::map<uint64_t, uint64_t> free_;  ///< Lengths of free runs by their first units; none touch.
  std::set<std::pair<uint64_t, uint64_t>> by_length_;  ///< The same: length, first unit.
  uint64_t end_ = 0, in_use_ = 0;
};

}  // namespace dtsdf
