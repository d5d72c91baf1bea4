#include "page/page_store.h"

#include <xxhash.h>

#include <algorithm>
#include <new>
#include <numeric>
#include <utility>

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

PageStore::PageStore(const std::string& folder, uint64_t max_bytes, size_t queue_bytes)
    : max_bytes_(max_bytes),
      file_(folder),
      queue_(file_, queue_bytes),
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

bool PageStore::write(const std::vector<PagedBlock>& blocks, PageBytes records) {
  std::vector<Page> pages;
  std::string problem;
  size_t entered = 0;
  try {
    problem = write(blocks, std::move(records), pages);
    for (; problem.empty() && entered < pages.size(); ++entered) enter(pages[entered]);
  } catch (const std::bad_alloc&) {
    problem = "out of memory";
  }
  if (problem.empty()) return true;
  for (size_t i = 0; i < pages.size(); ++i) {
    if (i < entered) {
      leave(index_.find(pages[i].block.key));
    } else {
      giveBack(pages[i]);
    }
  }
  problem_ = std::move(problem);
  return false;
}

/// @param pages Gets those that take room in the file from now on. @return what is wrong.
std::string PageStore::write(const std::vector<PagedBlock>& blocks, PageBytes records,
                             std::vector<Page>& pages) {
  pages.reserve(blocks.size());  // so that none is lost that has taken room
  std::vector<PageSpan> spans;
  for (const PagedBlock& block : blocks) {
    const auto first = runs_.take(unitsOf(block));
    if (!first) return kIsFull;
    pages.push_back({block, 0, static_cast<uint32_t>(*first)});
    spans.push_back(spanOf(pages.back()));
  }
  forEachRecord(blocks, [&](size_t i, size_t begin) {
    pages[i].checksum = XXH3_64bits(records.data() + begin, spans[i].bytes);
  });
  return queue_.write(spans, std::move(records));
}

PageSpan PageStore::spanOf(const Page& page) const {
  return {page.first_unit * kUnitBytes, recordBytes(page.block)};
}

/// @throws std::bad_alloc and nothing has changed then.
void PageStore::enter(const Page& page) {
  if (free_numbers_.empty()) {
    if (pages_.size() == pages_.capacity()) {
      const size_t more = 2 * pages_.size() + 1;
      free_numbers_.reserve(more);  // for all of them: who leaves takes no memory
      pages_.reserve(more);
    }
    free_numbers_.push_back(static_cast<int32_t>(pages_.size()));
    pages_.push_back(page);
  }
  const int32_t number = free_numbers_.back();
  cells_.insert(unpackKey(page.block.key), number);
  try {
    index_.insert(page.block.key, number);
  } catch (const std::bad_alloc&) {
    cells_.erase(unpackKey(page.block.key), number);
    throw;
  }
  pages_[size(number)] = page;
  free_numbers_.pop_back();
  marked_ += isMarked(page.block) ? 1 : 0;
}

/// What is in the file is needed no longer.
void PageStore::giveBack(const Page& page) {
  queue_.forget(spanOf(page).offset);
  runs_.give(page.first_unit, unitsOf(page.block));
}

void PageStore::leave(int32_t number) {
  const Page& page = pages_[size(number)];
  giveBack(page);
  index_.erase(page.block.key);
  cells_.erase(unpackKey(page.block.key), number);
  free_numbers_.push_back(number);
  marked_ -= isMarked(page.block) ? 1 : 0;
}

void PageStore::setMarks(int32_t number, bool dirty, bool painted) {
  PagedBlock& block = pages_[size(number)].block;
  marked_ -= isMarked(block) ? 1 : 0;
  block.dirty = dirty;
  block.painted = painted;
  marked_ += isMarked(block) ? 1 : 0;
}

/// In the order of the file.
std::vector<uint8_t> PageStore::read(const std::vector<int32_t>& numbers, PageBytes& records) {
  std::vector<size_t> begins(numbers.size() + 1, 0), order(numbers.size());
  for (size_t i = 0; i < numbers.size(); ++i) {
    begins[i + 1] = begins[i] + recordBytes(block(numbers[i]));
  }
  records = PageBytes(begins.back());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return pages_[size(numbers[a])].first_unit < pages_[size(numbers[b])].first_unit;
  });
  std::vector<uint8_t> readings(numbers.size());
  std::vector<size_t> to_read;
  for (const size_t i : order) {
    const bool is_in_memory =
        queue_.find(spanOf(pages_[size(numbers[i])]), records.data() + begins[i]);
    if (is_in_memory) readings[i] = check(pages_[size(numbers[i])], records.data() + begins[i]);
    if (!is_in_memory) to_read.push_back(i);
  }
  if (to_read.empty()) return readings;
  const WaitTimer timer(read_waits_);
  for (const size_t i : to_read) {
    readings[i] = read(pages_[size(numbers[i])], records.data() + begins[i]);
  }
  return readings;
}

PageReading PageStore::read(const Page& page, char* record) {
  bool is_short;
  const PageSpan span = spanOf(page);
  const std::string problem = file_.read(span.offset, record, span.bytes, is_short);
  if (problem.empty()) return check(page, record);
  problem_ = problem;
  return is_short ? kPageDamaged : kPageUnreadable;
}

PageReading PageStore::check(const Page& page, const char* record) {
  if (XXH3_64bits(record, recordBytes(page.block)) == page.checksum) return kPageIntact;
  problem_ = "what was read from map/page_folder is damaged; check the disk";
  return kPageDamaged;
}

void PageStore::readAhead(const std::vector<int32_t>& numbers) {
  std::vector<PageSpan> spans;
  for (const int32_t number : numbers) spans.push_back(spanOf(pages_[size(number)]));
  queue_.readAhead(std::move(spans));
}

void PageStore::release(const std::vector<int32_t>& numbers) {
  const uint64_t end = runs_.end();
  is_full_[0] = is_full_[1] = false;
  for (const int32_t number : numbers) leave(number);
  if (runs_.end() < end) queue_.shrink(runs_.end() * kUnitBytes);
}

void PageStore::clear() {
  visit([&](int32_t number, const PagedBlock&) { giveBack(pages_[size(number)]); });
  index_.clear();
  cells_.clear();
  pages_.clear();
  free_numbers_.clear();
  runs_.clear();
  marked_ = 0;
  is_full_[0] = is_full_[1] = false;
  problem_.clear();
  queue_.shrink(0);
}

uint64_t PageStore::bytes() const { return runs_.inUse() * kUnitBytes; }

size_t PageStore::indexBytes() const {
  return runs_.bytes() + index_.memoryBytes() + cells_.memoryBytes() +
         pages_.capacity() * sizeof(Page) + free_numbers_.capacity() * sizeof(int32_t);
}

}  // namespace dtsdf
