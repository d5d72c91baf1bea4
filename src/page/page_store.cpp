#include "page/page_store.h"

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

bool PageStore::write(const std::vector<PagedBlock>& blocks, const SharedRecords& records) {
  std::vector<Page> pages;
  std::vector<int32_t> numbers;
  std::string problem;
  try {
    problem = takeRoom(blocks, pages);
    if (problem.empty()) {
      numbers.reserve(pages.size());
      for (const Page& page : pages) numbers.push_back(enter(page));
      problem = queue_.write(spansOf(numbers), records);
    }
  } catch (const std::bad_alloc&) {
    problem = "out of memory";
  }
  if (problem.empty()) return true;
  for (size_t i = numbers.size(); i < pages.size(); ++i) giveRoomBack(pages[i]);
  leave(numbers);
  problem_ = std::move(problem);
  return false;
}

/// @param pages Gets those that take room in the file from now on. @return what is wrong.
std::string PageStore::takeRoom(const std::vector<PagedBlock>& blocks, std::vector<Page>& pages) {
  pages.reserve(blocks.size());  // so that none is lost that has taken room
  for (const PagedBlock& block : blocks) {
    const auto first = runs_.take(unitsOf(block));
    if (!first) return kIsFull;
    pages.push_back({block, 0, static_cast<uint32_t>(*first)});
  }
  return "";
}

uint64_t PageStore::offsetOf(const Page& page) { return page.first_unit * kUnitBytes; }

std::vector<PageSpan> PageStore::spansOf(const std::vector<int32_t>& numbers) {
  std::vector<PageSpan> spans;
  spans.reserve(numbers.size());
  for (const int32_t number : numbers) spans.push_back(spanOf(pages_[size(number)]));
  return spans;
}

/// @return its number. @throws std::bad_alloc and nothing has changed then.
int32_t PageStore::enter(const Page& page) {
  if (free_numbers_.empty()) {
    if (pages_.size() == free_numbers_.capacity()) {
      free_numbers_.reserve(2 * pages_.size() + 1);  // for all of them: who leaves takes no memory
    }
    pages_.push_back(page);
    free_numbers_.push_back(static_cast<int32_t>(pages_.size() - 1));
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
  return number;
}

void PageStore::giveRoomBack(const Page& page) { runs_.give(page.first_unit, unitsOf(page.block)); }

void PageStore::leave(const std::vector<int32_t>& numbers) {
  queue_.forget(numbers.size(), [&](size_t i) { return offsetOf(pages_[size(numbers[i])]); });
  for (const int32_t number : numbers) {
    const Page& page = pages_[size(number)];
    giveRoomBack(page);
    index_.erase(page.block.key);
    cells_.erase(unpackKey(page.block.key), number);
    free_numbers_.push_back(number);
    marked_ -= isMarked(page.block) ? 1 : 0;
  }
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
  size_t bytes = 0;
  for (const int32_t number : numbers) {
    blocks.push_back(block(number));
    bytes += recordBytes(blocks.back());
  }
  std::vector<RecordPlace> places;
  std::vector<uint8_t> readings = fetch(numbers, makePlainRecords, places);
  records = PageBytes(bytes);
  forEachRecord(blocks, [&](size_t i, size_t begin) {
    if (readings[i] != kPageIntact) return;
    places[i].records->wait();
    std::memcpy(records.data() + begin, places[i].data(), recordBytes(blocks[i]));
  });
  return readings;
}

std::vector<uint8_t> PageStore::fetch(const std::vector<int32_t>& numbers, const RecordsMaker& make,
                                      std::vector<RecordPlace>& places) {
  const std::vector<PageSpan> spans = spansOf(numbers);
  places = queue_.find(spans);
  return readMissing(spans, make, places);
}

size_t PageStore::countInMemory(const std::vector<int32_t>& numbers) const {
  std::vector<PageSpan> spans;
  spans.reserve(numbers.size());
  for (const int32_t number : numbers) {
    const Page& page = pages_[size(number)];
    spans.push_back({offsetOf(page), recordBytes(page.block), nullptr});
  }
  const std::vector<RecordPlace> places = queue_.find(spans);
  const auto is_missing = [](const RecordPlace& place) { return place.records == nullptr; };
  return static_cast<size_t>(std::find_if(places.begin(), places.end(), is_missing) -
                             places.begin());
}

/// In the order of the file. @return a PageReading for each.
std::vector<uint8_t> PageStore::readMissing(const std::vector<PageSpan>& spans,
                                            const RecordsMaker& make,
                                            std::vector<RecordPlace>& places) {
  std::vector<size_t> missing;
  size_t bytes = 0;
  for (size_t i = 0; i < spans.size(); ++i) {
    if (places[i].records != nullptr) continue;
    missing.push_back(i);
    bytes += spans[i].bytes;
  }
  std::vector<uint8_t> readings(spans.size(), kPageIntact);
  if (missing.empty()) return readings;
  std::sort(missing.begin(), missing.end(),
            [&](size_t a, size_t b) { return spans[a].offset < spans[b].offset; });
  const WaitTimer timer(read_waits_);
  const SharedRecords records = make(bytes);
  size_t begin = 0;
  for (const size_t i : missing) {
    places[i] = {records, begin};
    begin += spans[i].bytes;
    bool is_short;
    char* const record = records->data() + places[i].begin;
    const std::string problem = file_.read(spans[i].offset, record, spans[i].bytes, is_short);
    if (!problem.empty()) {
      problem_ = problem;
      readings[i] = is_short ? kPageDamaged : kPageUnreadable;
    } else if (checksumOf(record, spans[i].bytes) != *spans[i].checksum) {
      problem_ = "what was read from map/page_folder is damaged; check the disk";
      readings[i] = kPageDamaged;
    }
  }
  return readings;
}

void PageStore::readAhead(const std::vector<int32_t>& numbers, const RecordsMaker& make) {
  queue_.readAhead(spansOf(numbers), make);
}

void PageStore::release(const std::vector<int32_t>& numbers) {
  const uint64_t end = runs_.end();
  is_full_[0] = is_full_[1] = false;
  leave(numbers);
  if (runs_.end() < end) queue_.shrink(runs_.end() * kUnitBytes);
}

void PageStore::clear() {
  visit([&](int32_t number, const PagedBlock&) {
    queue_.forget(1, [&](size_t) { return offsetOf(pages_[size(number)]); });
  });
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
         pages_.size() * sizeof(Page) + free_numbers_.capacity() * sizeof(int32_t);
}

}  // namespace dtsdf
