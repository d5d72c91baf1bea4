#include "page/page_store.h"

#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

#include "kernels/meshing/unit_samples.h"

namespace dtsdf {
namespace {

/// Of the file. All that blocks hold comes in multiples of it.
constexpr uint64_t kUnitBytes = 256;
constexpr size_t kLabelBytes = kVoxelsPerBlock * sizeof(UnitLabels);
static_assert(BlockTable::kArrayBytes % kUnitBytes == 0 &&
              BlockTable::kColourBytes % kUnitBytes == 0 && kLabelBytes % kUnitBytes == 0);

constexpr uint8_t kCorrupt = 255;  ///< Of readings, until it is told.

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

std::vector<uint8_t> PageStore::read(const std::vector<int32_t>& numbers, PageBytes& records) {
  std::vector<PagedBlock> blocks;
  std::vector<PageSpan> spans;
  size_t bytes = 0;
  for (const int32_t number : numbers) {
    blocks.push_back(block(number));
    spans.push_back(spanOf(pages_[size(number)]));
    bytes += spans.back().bytes;
  }
  records = PageBytes(bytes);
  const std::vector<PageQueue::Entry> in_memory = queue_.find(spans);
  std::vector<uint8_t> readings = readMissing(spans, in_memory, records);
  forEachRecord(blocks, [&](size_t i, size_t begin) {
    char* const record = records.data() + begin;
    if (in_memory[i].batch != nullptr) std::memcpy(record, in_memory[i].data(), spans[i].bytes);
    if (readings[i] != kPageIntact) return;
    const bool is_same = XXH3_64bits(record, spans[i].bytes) == pages_[size(numbers[i])].checksum;
    if (!is_same) readings[i] = kCorrupt;
  });
  for (uint8_t& reading : readings) {
    if (reading != kCorrupt) continue;
    reading = kPageDamaged;
    problem_ = "what was read from map/page_folder is damaged; check the disk";
  }
  return readings;
}

/// In the order of the file. @return a PageReading for each, whatever is in it.
std::vector<uint8_t> PageStore::readMissing(const std::vector<PageSpan>& spans,
                                            const std::vector<PageQueue::Entry>& in_memory,
                                            PageBytes& records) {
  struct Missing {
    uint64_t offset;
    size_t begin, i;
  };
  std::vector<Missing> missing;
  for (size_t i = 0, begin = 0; i < spans.size(); begin += spans[i++].bytes) {
    if (in_memory[i].batch == nullptr) missing.push_back({spans[i].offset, begin, i});
  }
  std::vector<uint8_t> readings(spans.size(), kPageIntact);
  if (missing.empty()) return readings;
  std::sort(missing.begin(), missing.end(),
            [](const Missing& a, const Missing& b) { return a.offset < b.offset; });
  const WaitTimer timer(read_waits_);
  for (const Missing& one : missing) {
    bool is_short;
    const std::string problem =
        file_.read(one.offset, records.data() + one.begin, spans[one.i].bytes, is_short);
    if (problem.empty()) continue;
    problem_ = problem;
    readings[one.i] = is_short ? kPageDamaged : kPageUnreadable;
  }
  return readings;
}

void PageStore::readAhead(const std::vector<int32_t>& numbers) {
  std::vector<PageSpan> spans;
  spans.reserve(numbers.size());
  for (const int32_t number : numbers) spans.push_back(spanOf(pages_[size(number)]));
  queue_.readAhead(spans);
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
