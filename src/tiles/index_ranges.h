/// Numbers of images, mostly one after the other: kept as ranges.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace dtsdf {

class IndexRanges {
 public:
  /// First and last of each range, rising.
  using Range = std::pair<size_t, size_t>;

  IndexRanges() = default;
  /// @throws std::runtime_error if the ranges are not rising.
  explicit IndexRanges(std::vector<Range> ranges);

  /// The numbers that are in any of them.
  static IndexRanges unite(const std::vector<const IndexRanges*>& parts);

  /// @pre The number is above those before it, or the last one again.
  void add(size_t index);

  bool contains(size_t index) const;
  bool empty() const { return ranges_.empty(); }
  size_t count() const;
  std::vector<size_t> list() const;
  const std::vector<Range>& ranges() const { return ranges_; }

 private:
  std::vector<Range> ranges_;
};

}  // namespace dtsdf
