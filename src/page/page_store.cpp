#include "page/page_store.h"

#include <xxhash.h>

#include <algorithm>
#include <numeric>

#include "kernels/meshing/unit_samples.h"

namespace dtsdf {
namespace {

/// Of the file. All that blocks hold comes in multiples of it.
constexpr uint64_t kUnitBytes = 256;
constexpr size_t kLabelBytes = kVoxelsPerBlock * sizeof(UnitLabels);
static_assert(BlockTable::kArrayBytes % kUnitBytes == 0 &&
              BlockTable::kColourBytes % kUnitBytes == 0 && kLabelBytes % kUnitBytes == 0);

constexpr const char* kIsFull = "what is in map/page_folder has reached map/page_max_gb; raise it";

uint64_t unitsOf(const PagedBlock& block) { return recordBytes(block) / kUnitBytes; }

}  // namespace

size_t recordBytes(const PagedBlock& block) {
  return static_cast<size_t>(__builtin_popcount(block.directions)) * BlockTable::kArrayBytes +
         static_cast<size_t>(__builtin_popcountll(block.bricks)) * BlockTable::kColourBytes +
         (block.has_labels ? kLabelBytes : 0);
}

PageStore::PageStore(const std::string& folder, uint64_t max_bytes)
    : max_bytes_(max_bytes),
      file_(folder),
      runs_(std::min<uint64_t>(max_bytes / kUnitBytes, UINT32_MAX)) {}

uint64_t PageStore::room(bool with_reserve) const {
  constexpr uint64_t kMostReserve = uint64_t{32} << 20;
  const uint64_t reserve = with_reserve ? 0 : std::min(max_bytes_ / 8, kMostReserve);
  return max_bytes_ - std::min(max_bytes_, bytes() + reserve);
}

bool PageStore::hasRoomFor(uint64_t bytes, bool with_reserve) {
  if (bytes <= room(with_reserve)) return true;
  problem_ = kIsFull;
  is_full_[with_reserve ? 1 : 0] = true;
  return false;
}

bool PageStore::write(const std::vector<PagedBlock>& blocks, const std::vector<char>& records) {
  std::vector<Page> pages;
  const char* record = records.data();
  for (const PagedBlock& block : blocks) {
    const auto first = runs_.take(unitsOf(block));
    if (!first) {
      problem_ = kIsFull;
      break;
    }
    pages.push_back(
        {block, XXH3_64bits(record, recordBytes(block)), static_cast<uint32_t>(*first)});
    record += recordBytes(block);
  }
  if (pages.size() < blocks.size() || !writeRuns(pages, records)) {
    for (const Page& page : pages) runs_.give(page.first_unit, unitsOf(page.block));
    return false;
  }
  for (const Page& page : pages) enter(page);
  return true;
}

/// Runs that touch are written at once.
bool PageStore::writeRuns(const std::vector<Page>& pages, const std::vector<char>& records) {
  size_t begin = 0, bytes = 0;
  uint64_t first = 0;
  for (size_t i = 0; i <= pages.size(); ++i) {
    const bool touches =
        i < pages.size() && bytes > 0 && first + bytes / kUnitBytes == pages[i].first_unit;
    if (!touches && bytes > 0) {
      const std::string problem = file_.write(first * kUnitBytes, records.data() + begin, bytes);
      if (!problem.empty()) {
        problem_ = problem;
        return false;
      }
      begin += bytes;
      bytes = 0;
    }
    if (i == pages.size()) break;
    if (bytes == 0) first = pages[i].first_unit;
    bytes += recordBytes(pages[i].block);
  }
  return true;
}

void PageStore::enter(const Page& page) {
  int32_t number;
  if (free_numbers_.empty()) {
    number = static_cast<int32_t>(pages_.size());
    pages_.push_back(page);
  } else {
    number = free_numbers_.back();
    free_numbers_.pop_back();
    pages_[size(number)] = page;
  }
  index_.insert(page.block.key, number);
  cells_.insert(unpackKey(page.block.key), number);
}

/// In the order of the file.
std::vector<uint8_t> PageStore::read(const std::vector<int32_t>& numbers,
                                     std::vector<char>& records) {
  std::vector<size_t> begins(numbers.size() + 1, 0), order(numbers.size());
  for (size_t i = 0; i < numbers.size(); ++i) {
    begins[i + 1] = begins[i] + recordBytes(block(numbers[i]));
  }
  records.resize(begins.back());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return pages_[size(numbers[a])].first_unit < pages_[size(numbers[b])].first_unit;
  });
  std::vector<uint8_t> readings(numbers.size(), kPageDamaged);
  for (const size_t i : order) {
    const Page& page = pages_[size(numbers[i])];
    char* const record = records.data() + begins[i];
    const size_t bytes = begins[i + 1] - begins[i];
    bool is_short;
    const std::string problem = file_.read(page.first_unit * kUnitBytes, record, bytes, is_short);
    if (!problem.empty()) {
      problem_ = problem;
      if (!is_short) readings[i] = kPageUnreadable;
    } else if (XXH3_64bits(record, bytes) == page.checksum) {
      readings[i] = kPageIntact;
    } else {
      problem_ = "what was read from map/page_folder is damaged; check the disk";
    }
  }
  return readings;
}

void PageStore::release(const std::vector<int32_t>& numbers) {
  const uint64_t end = runs_.end();
  is_full_[0] = is_full_[1] = false;
  for (const int32_t number : numbers) {
    const Page& page = pages_[size(number)];
    runs_.give(page.first_unit, unitsOf(page.block));
    index_.erase(page.block.key);
    cells_.erase(unpackKey(page.block.key), number);
    free_numbers_.push_back(number);
  }
  if (runs_.end() < end) file_.truncate(runs_.end() * kUnitBytes);
}

void PageStore::clear() {
  std::vector<int32_t> all;
  visit([&](int32_t number, const PagedBlock&) { all.push_back(number); });
  release(all);
  pages_.clear();
  free_numbers_.clear();
  problem_.clear();
}

uint64_t PageStore::bytes() const { return runs_.inUse() * kUnitBytes; }

size_t PageStore::indexBytes() const {
  return index_.memoryBytes() + cells_.memoryBytes() + pages_.capacity() * sizeof(Page) +
         free_numbers_.capacity() * sizeof(int32_t);
}

}  // namespace dtsdf
