#include "page/page_queue.h"

#include <xxhash.h>

#include <algorithm>
#include <exception>
#include <new>
#include <utility>

namespace dtsdf {
namespace {

/// Of records that are written, or read, at once.
constexpr size_t kBytesAtOnce = size_t{1} << 20;

}  // namespace

uint64_t checksumOf(const char* record, size_t bytes) { return XXH3_64bits(record, bytes); }

PageQueue::PageQueue(PageFile& file, size_t most_bytes)
    : file_(file), most_bytes_(most_bytes), thread_([this] { run(); }) {}

PageQueue::~PageQueue() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  to_do_.notify_all();
  thread_.join();
}

template <class Test>
void PageQueue::waitUntil(std::unique_lock<std::mutex>& lock, const Test& test) {
  if (test()) return;
  const WaitTimer timer(waits_);
  done_.wait(lock, test);
}

std::string PageQueue::write(const std::vector<PageSpan>& records, const SharedRecords& bytes) {
  std::unique_lock<std::mutex> lock(mutex_);
  const bool retries = !problem_.empty();
  problem_.clear();
  to_do_.notify_all();
  const size_t limit = bytes->size() < most_bytes_ ? most_bytes_ - bytes->size() : 0;
  const size_t last = retries && !order_.empty() ? order_.front().second : 0;
  const auto may_go_on = [&] {
    const bool is_tried = order_.empty() || order_.front().second > last;
    return !problem_.empty() || (waiting_bytes_ <= limit && is_tried);
  };
  waitUntil(lock, may_go_on);
  if (!problem_.empty()) return problem_;
  size_t begin = 0;
  for (const PageSpan& record : records) {
    order_.emplace_back(record.offset, ++last_number_);
    waiting_[record.offset] = {{bytes, begin}, record.bytes, last_number_, record.checksum};
    waiting_bytes_ += record.bytes;
    begin += record.bytes;
  }
  lock.unlock();
  to_do_.notify_all();
  return "";
}

std::vector<RecordPlace> PageQueue::find(const std::vector<PageSpan>& records) const {
  std::vector<RecordPlace> places(records.size());
  const std::lock_guard<std::mutex> lock(mutex_);
  for (size_t i = 0; i < records.size(); ++i) {
    if (const auto found = waiting_.find(records[i].offset); found != waiting_.end()) {
      places[i] = found->second.place;
      continue;
    }
    const auto found = ahead_.find(records[i].offset);
    if (found != ahead_.end() && found->second.bytes == records[i].bytes) {
      places[i] = found->second.place;
    }
  }
  return places;
}

/// What is under way is not waited for: records that get the place next are written after it.
void PageQueue::forgetOne(uint64_t offset) {
  if (const auto found = waiting_.find(offset); found != waiting_.end()) {
    waiting_bytes_ -= found->second.bytes;
    waiting_.erase(found);
  }
  dropAhead(offset);
  reading_.erase(offset);
  wanted_.erase(offset);
}

/// Whether a record is in memory, or comes there.
bool PageQueue::isAhead(uint64_t offset) const {
  return reading_.count(offset) + waiting_.count(offset) + ahead_.count(offset) != 0;
}

void PageQueue::readAhead(const std::vector<PageSpan>& records, const RecordsMaker& make) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    make_ = make;
    asked_.clear();
    wanted_.clear();
    size_t bytes = 0;
    for (const PageSpan& record : records) {
      bytes += record.bytes;
      if (bytes > most_bytes_) break;
      if (isAhead(record.offset)) continue;
      wanted_.insert(record.offset);
      asked_.push_back(record);
    }
  }
  to_do_.notify_all();
}

/// What may be needed soon comes first: there is a limit to it, and someone may wait for it.
void PageQueue::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    to_do_.wait(lock, [this] {
      return ends_ || !asked_.empty() || hasWriting() || shrink_to_ != kNothing;
    });
    if (ends_) return;
    const bool reads = !asked_.empty();
    std::string problem;
    try {
      while (shrink_to_ != kNothing) shrinkNow(lock);  // before what takes that place is written
      if (reads) {
        readNext(lock);
      } else if (hasWriting()) {
        writeNext(lock);
      }
    } catch (const std::bad_alloc&) {
      problem = "out of memory";
    } catch (const std::exception& error) {
      problem = error.what();
    }
    if (!lock.owns_lock()) lock.lock();
    if (!problem.empty()) fail(reads, problem);
    done_.notify_all();
  }
}

/// What was to be read is not read ahead; what was to be written is tried again by write().
void PageQueue::fail(bool reads, const std::string& problem) {
  if (reads) {
    reading_.clear();
  } else {
    problem_ = problem;
  }
}

/// Records that come next, as far as they lie side by side in memory and in the file. They stay in
/// the order until they are written.
std::vector<PageQueue::Entry> PageQueue::nextToWrite() {
  std::vector<Entry> next;
  size_t bytes = 0;
  uint64_t end = 0;
  while (next.size() < order_.size() && bytes < kBytesAtOnce) {
    const auto [offset, number] = order_[next.size()];
    const auto found = waiting_.find(offset);
    const bool is_needed = found != waiting_.end() && found->second.number == number;
    if (next.empty() && !is_needed) {
      order_.pop_front();
      continue;
    }
    if (!is_needed) break;
    const Entry& entry = found->second;
    const bool goes_on =
        next.empty() || (offset == end && entry.place.records == next.back().place.records &&
                         entry.place.begin == next.back().place.begin + next.back().bytes);
    if (!goes_on) break;
    next.push_back(entry);
    bytes += entry.bytes;
    end = offset + entry.bytes;
  }
  return next;
}

void PageQueue::writeNext(std::unique_lock<std::mutex>& lock) {
  const std::vector<Entry> next = nextToWrite();
  if (next.empty()) return;
  const uint64_t offset = order_.front().first;
  lock.unlock();
  next.front().place.records->wait();
  std::vector<uint64_t> checksums;
  size_t bytes = 0;
  for (const Entry& entry : next) {
    checksums.push_back(checksumOf(entry.place.data(), entry.bytes));
    bytes += entry.bytes;
  }
  const std::string problem = file_.write(offset, next.front().place.data(), bytes);
  lock.lock();
  if (!problem.empty()) problem_ = problem;
  for (size_t i = 0; problem.empty() && i < next.size(); ++i) {
    const auto now = waiting_.find(order_.front().first);
    order_.pop_front();
    if (now == waiting_.end() || now->second.number != next[i].number) continue;
    *next[i].checksum = checksums[i];
    waiting_bytes_ -= next[i].bytes;
    waiting_.erase(now);
  }
}

/// Those that are asked for, some at a time, in the order of the file.
std::vector<PageSpan> PageQueue::nextToRead() {
  std::vector<PageSpan> next;
  size_t bytes = 0;
  for (; !asked_.empty() && bytes < kBytesAtOnce; asked_.pop_front()) {
    const PageSpan& record = asked_.front();
    if (wanted_.erase(record.offset) == 0 || isAhead(record.offset)) continue;  // asked for twice
    next.push_back(record);
    reading_.insert(record.offset);
    bytes += record.bytes;
  }
  std::sort(next.begin(), next.end(),
            [](const PageSpan& a, const PageSpan& b) { return a.offset < b.offset; });
  return next;
}

/// What cannot be read, or is damaged, shows when it is needed.
void PageQueue::readNext(std::unique_lock<std::mutex>& lock) {
  const std::vector<PageSpan> next = nextToRead();
  if (next.empty()) return;
  const RecordsMaker make = make_;
  lock.unlock();
  size_t bytes = 0;
  for (const PageSpan& record : next) bytes += record.bytes;
  const SharedRecords records = make(bytes);
  std::vector<uint64_t> checksums(next.size());
  std::vector<bool> is_read(next.size());
  char* record = records->data();
  for (size_t i = 0, end = 0; i < next.size(); i = end) {
    size_t run_bytes = next[i].bytes;  // of records side by side
    for (end = i + 1; end < next.size() && next[end].offset == next[i].offset + run_bytes; ++end) {
      run_bytes += next[end].bytes;
    }
    bool is_short;
    const bool is_run_read = file_.read(next[i].offset, record, run_bytes, is_short).empty();
    for (size_t k = i; k < end; record += next[k++].bytes) {
      is_read[k] = is_run_read;
      if (is_run_read) checksums[k] = checksumOf(record, next[k].bytes);
    }
  }
  lock.lock();
  for (size_t i = 0, begin = 0; i < next.size(); begin += next[i++].bytes) {
    const bool is_needed = reading_.erase(next[i].offset) > 0;
    if (!is_read[i] || !is_needed || checksums[i] != *next[i].checksum) continue;
    read_.push_back(next[i].offset);
    dropAhead(next[i].offset);
    size_t& held = held_[records.get()];
    ahead_[next[i].offset] = {{records, begin}, next[i].bytes, 0, nullptr};
    if (held++ == 0) ahead_bytes_ += records->size();
  }
  dropOldestAhead();
}

/// Memory goes with the last record in it.
void PageQueue::dropAhead(uint64_t offset) {
  const auto found = ahead_.find(offset);
  if (found == ahead_.end()) return;
  const auto held = held_.find(found->second.place.records.get());
  if (--held->second == 0) {
    ahead_bytes_ -= held->first->size();
    held_.erase(held);
  }
  ahead_.erase(found);
}

/// The oldest go where there is no room for all.
void PageQueue::dropOldestAhead() {
  while (!read_.empty() && (ahead_bytes_ > most_bytes_ || ahead_.count(read_.front()) == 0)) {
    dropAhead(read_.front());
    read_.pop_front();
  }
}

void PageQueue::shrink(uint64_t file_bytes) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    shrink_to_ = file_bytes;
  }
  to_do_.notify_all();
}

/// What was written so far is there by now, so that nothing makes the file longer again that nobody
/// needs.
void PageQueue::shrinkNow(std::unique_lock<std::mutex>& lock) {
  const uint64_t bytes = std::exchange(shrink_to_, kNothing);
  is_shrinking_ = true;
  lock.unlock();
  file_.truncate(bytes);
  lock.lock();
  is_shrinking_ = false;
}

void PageQueue::finish() {
  std::unique_lock<std::mutex> lock(mutex_);
  done_.wait(lock, [this] { return !hasWriting() && !hasReading() && !hasShrinking(); });
}

size_t PageQueue::bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return waiting_bytes_ + ahead_bytes_;
}

}  // namespace dtsdf
