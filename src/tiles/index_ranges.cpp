#include "tiles/index_ranges.h"

#include <algorithm>
#include <stdexcept>

namespace dtsdf {

IndexRanges::IndexRanges(std::vector<Range> ranges) : ranges_(std::move(ranges)) {
  for (size_t i = 0; i < ranges_.size(); ++i) {
    const bool rises = i == 0 || ranges_[i - 1].second < ranges_[i].first;
    if (ranges_[i].first > ranges_[i].second || !rises) {
      throw std::runtime_error("the image numbers are not increasing");
    }
  }
}

IndexRanges IndexRanges::unite(const std::vector<const IndexRanges*>& parts) {
  std::vector<Range> all;
  for (const IndexRanges* part : parts) {
    all.insert(all.end(), part->ranges_.begin(), part->ranges_.end());
  }
  std::sort(all.begin(), all.end());
  IndexRanges united;
  for (const Range& range : all) {
    const bool goes_on = !united.ranges_.empty() && range.first <= united.ranges_.back().second + 1;
    if (!goes_on) united.ranges_.push_back(range);
    size_t& last = united.ranges_.back().second;
    last = std::max(last, range.second);
  }
  return united;
}

void IndexRanges::add(size_t index) {
  if (!ranges_.empty() && index <= ranges_.back().second + 1) {
    ranges_.back().second = std::max(ranges_.back().second, index);
  } else {
    ranges_.push_back({index, index});
  }
}

bool IndexRanges::contains(size_t index) const {
  const auto after =
      std::upper_bound(ranges_.begin(), ranges_.end(), index,
                       [](size_t value, const Range& range) { return value < range.first; });
  return after != ranges_.begin() && index <= (after - 1)->second;
}

size_t IndexRanges::count() const {
  size_t count = 0;
  for (const auto& [first, last] : ranges_) count += last - first + 1;
  return count;
}

std::vector<size_t> IndexRanges::list() const {
  std::vector<size_t> indices;
  for (const auto& [first, last] : ranges_) {
    for (size_t i = first; i <= last; ++i) indices.push_back(i);
  }
  return indices;
}

}  // namespace dtsdf
