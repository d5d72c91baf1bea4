#include "page/paged_values.h"

#include <algorithm>
#include <cstring>
#include <new>

namespace dtsdf {
namespace {

/// Of the file. Records are filled up to it.
constexpr uint64_t kValueUnitBytes = 256;

/// Of values that are written at once.
constexpr size_t kValuesAtOnce = size_t{1} << 20;

/// Beside what stays in memory, on its way to the disk; and what is written beyond what has to be,
/// so that not each value has to make room.
constexpr size_t kWaitingShare = 8, kFreedShare = 8;

/// After a failure, values that come until the disk is tried again.
constexpr size_t kKeptBetweenTries = 64;

/// After which what is to be changed is lost.
constexpr int kTriesToTake = 4;

/// An entry, and its node in a table, with what the system adds.
constexpr size_t kEntryBytes = 240;

constexpr const char* kCellsAreFull =
    "cells of space in map/page_folder have reached map/page_max_gb; raise it";

size_t unitsOf(size_t bytes) { return (bytes + kValueUnitBytes - 1) / kValueUnitBytes; }

}  // namespace

PagedValues::PagedValues(const std::string& folder, uint64_t max_bytes, size_t most_bytes)
    : file_(folder),
      queue_(file_, std::max(most_bytes / kWaitingShare, kValuesAtOnce)),
      runs_(max_bytes / kValueUnitBytes),
      most_bytes_(most_bytes) {}

std::shared_ptr<PagedValues::Entry> PagedValues::keep(std::shared_ptr<const void> value,
                                                      const ValueKind& kind) {
  auto entry = std::make_shared<Entry>(shared_from_this());
  const std::lock_guard<std::mutex> lock(mutex_);
  ++entries_;
  entry->kind = &kind;
  entry->place = order_.insert(order_.end(), entry.get());
  entry->bytes = kind.bytes(value.get());
  entry->value = std::move(value);
  bytes_ += entry->bytes;
  makeRoom();
  return entry;
}

std::shared_ptr<const void> PagedValues::get(Entry& entry) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (entry.value != nullptr) {
    order_.splice(order_.end(), order_, entry.place);
    return entry.value;
  }
  bring(entry);
  std::shared_ptr<const void> value = entry.value;
  makeRoom();
  return value;
}

std::shared_ptr<const void> PagedValues::take(Entry& entry) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (int i = 0; i < kTriesToTake && entry.value == nullptr; ++i) bring(entry);
  if (entry.value == nullptr && !entry.is_lost) ++stats_.lost;
  std::shared_ptr<const void> value = entry.value;
  leaveMemory(entry);
  leaveDisk(entry);
  entry.is_lost = true;
  return value;
}

void PagedValues::forget(Entry& entry) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (entry.kind == nullptr) return;
  leaveMemory(entry);
  leaveDisk(entry);
  --entries_;
}

void PagedValues::leaveMemory(Entry& entry) {
  if (entry.value == nullptr) return;
  bytes_ -= entry.bytes;
  order_.erase(entry.place);
  entry.value.reset();
}

void PagedValues::leaveDisk(Entry& entry) {
  if (entry.record_bytes == 0) return;
  queue_.forget(1, [&](size_t) { return entry.offset; });
  const uint64_t end = runs_.end();
  runs_.give(entry.offset / kValueUnitBytes, unitsOf(entry.record_bytes));
  entry.record_bytes = 0;
  if (runs_.end() < end) queue_.shrink(runs_.end() * kValueUnitBytes);
}

void PagedValues::bring(Entry& entry) {
  if (entry.is_lost) return;
  const RecordPlace place = queue_.find({spanOf(entry)}).front();
  PageBytes record;
  if (place.records == nullptr) {
    const WaitTimer timer(stats_.waits);
    record = PageBytes(entry.record_bytes);
    bool is_short = false;
    const std::string problem =
        file_.read(entry.offset, record.data(), entry.record_bytes, is_short);
    if (!problem.empty() && !is_short) {
      fail(problem);
      return;
    }
    if (is_short || checksumOf(record.data(), record.size()) != entry.checksum) {
      stats_.problem = "what was read from map/page_folder is damaged; check the disk";
      ++stats_.lost;
      entry.is_lost = true;
      return;
    }
  }
  auto value = entry.kind->read(place.records == nullptr ? record.data() : place.data());
  entry.place = order_.insert(order_.end(), &entry);
  entry.bytes = entry.kind->bytes(value.get());
  entry.value = std::move(value);
  bytes_ += entry.bytes;
}

/// Those that were used longest ago go. What is on disk already need not be written again.
void PagedValues::makeRoom() {
  if (bytes_ <= most_bytes_) return;
  if (calls_until_try_ > 0 && --calls_until_try_ > 0) return;
  const size_t aim = most_bytes_ - most_bytes_ / kFreedShare;
  while (bytes_ > aim && !order_.empty()) {
    std::vector<Entry*> batch;
    size_t batch_bytes = 0;
    for (auto next = order_.begin(); next != order_.end(); ++next) {
      if (bytes_ - batch_bytes <= aim || batch_bytes >= kValuesAtOnce) break;
      batch.push_back(*next);
      batch_bytes += (*next)->bytes;
    }
    if (!writeOut(batch)) {
      calls_until_try_ = kKeptBetweenTries;
      return;
    }
    for (Entry* const entry : batch) leaveMemory(*entry);
  }
}

/// @return whether they are on disk now, or on their way there.
bool PagedValues::writeOut(const std::vector<Entry*>& entries) {
  std::vector<Entry*> written;
  std::string problem;
  try {
    written.reserve(entries.size());  // so that none is lost that has taken room
    problem = takeRoom(entries, written);
    if (problem.empty()) problem = write(written);
  } catch (const std::bad_alloc&) {
    problem = "out of memory";
  }
  if (problem.empty()) return true;
  for (Entry* const entry : written) leaveDisk(*entry);
  return fail(problem);
}

/// @param written Gets those that take room in the file from now on. @return what is wrong.
std::string PagedValues::takeRoom(const std::vector<Entry*>& entries,
                                  std::vector<Entry*>& written) {
  for (Entry* const entry : entries) {
    if (entry->record_bytes > 0) continue;
    const size_t units = unitsOf(entry->kind->record_bytes(entry->value.get()));
    const auto first = runs_.take(units);
    if (!first) return kCellsAreFull;
    entry->offset = *first * kValueUnitBytes;
    entry->record_bytes = units * kValueUnitBytes;
    written.push_back(entry);
  }
  return "";
}

std::string PagedValues::write(const std::vector<Entry*>& entries) {
  if (entries.empty()) return "";
  std::vector<PageSpan> spans;
  size_t bytes = 0;
  for (Entry* const entry : entries) {
    spans.push_back(spanOf(*entry));
    bytes += entry->record_bytes;
  }
  const SharedRecords records = makePlainRecords(bytes);
  std::memset(records->data(), 0, bytes);
  char* record = records->data();
  for (const Entry* const entry : entries) {
    entry->kind->write(entry->value.get(), record);
    record += entry->record_bytes;
  }
  return queue_.write(spans, records);
}

bool PagedValues::fail(const std::string& problem) {
  stats_.problem = problem;
  ++stats_.failures;
  return false;
}

bool PagedValues::isLost(const Entry& entry) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return entry.is_lost;
}

bool PagedValues::isFull() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return bytes_ > most_bytes_;
}

size_t PagedValues::bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return bytes_ + queue_.bytes();
}

PagedValues::Stats PagedValues::stats() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Stats stats = stats_;
  stats.bytes = runs_.inUse() * kValueUnitBytes;
  stats.index_bytes = entries_ * kEntryBytes + runs_.bytes();
  stats.waits.count += queue_.waits().count;
  stats.waits.ms += queue_.waits().ms;
  return stats;
}

void PagedValues::resetCounts() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const DiskWaits waits = stats_.waits;
  stats_ = Stats();
  stats_.waits = waits;
}

}  // namespace dtsdf
