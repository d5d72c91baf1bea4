#include "page/page_queue.h"

#include <algorithm>
#include <exception>
#include <utility>

namespace dtsdf {

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

std::string PageQueue::write(const std::vector<PageSpan>& records, PageBytes bytes) {
  const auto batch = std::make_shared<const PageBytes>(std::move(bytes));
  std::unique_lock<std::mutex> lock(mutex_);
  const bool retries = !problem_.empty();
  problem_.clear();
  to_do_.notify_all();
  const size_t limit = batch->size() < most_bytes_ ? most_bytes_ - batch->size() : 0;
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
    waiting_[record.offset] = {batch, begin, record.bytes, last_number_};
    waiting_bytes_ += record.bytes;
    begin += record.bytes;
  }
  lock.unlock();
  to_do_.notify_all();
  return "";
}

std::vector<PageQueue::Entry> PageQueue::find(const std::vector<PageSpan>& records) const {
  std::vector<Entry> entries(records.size());
  const std::lock_guard<std::mutex> lock(mutex_);
  for (size_t i = 0; i < records.size(); ++i) {
    if (const auto found = waiting_.find(records[i].offset); found != waiting_.end()) {
      entries[i] = found->second;
      continue;
    }
    const auto found = ahead_.find(records[i].offset);
    if (found != ahead_.end() && found->second.bytes == records[i].bytes) {
      entries[i] = found->second;
    }
  }
  return entries;
}

/// What is under way is not waited for: records that get the place next are written after it.
void PageQueue::forget(uint64_t offset) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (const auto found = waiting_.find(offset); found != waiting_.end()) {
    waiting_bytes_ -= found->second.bytes;
    waiting_.erase(found);
    done_.notify_all();
  }
  if (const auto found = ahead_.find(offset); found != ahead_.end()) {
    ahead_bytes_ -= found->second.bytes;
    ahead_.erase(found);
  }
  if (reading_ == offset) is_reading_in_vain_ = true;
  wanted_.erase(offset);
}

/// Whether a record is in memory, or comes there.
bool PageQueue::isAhead(uint64_t offset) const {
  const bool comes = reading_ == offset && !is_reading_in_vain_;
  return comes || waiting_.count(offset) + ahead_.count(offset) != 0;
}

void PageQueue::readAhead(const std::vector<PageSpan>& records) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
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
    to_do_.wait(lock, [this] { return ends_ || !asked_.empty() || hasWriting(); });
    if (ends_) return;
    const bool reads = !asked_.empty();
    try {
      reads ? readNext(lock) : writeNext(lock);
    } catch (const std::exception&) {
      if (!lock.owns_lock()) lock.lock();
      lackMemory(reads);
    }
  }
}

/// What was to be read is not read ahead; what was to be written is tried again by write().
void PageQueue::lackMemory(bool reads) {
  if (reads) reading_ = kNothing;
  if (!reads) problem_ = "out of memory";
  is_writing_ = false;
  done_.notify_all();
}

void PageQueue::writeNext(std::unique_lock<std::mutex>& lock) {
  const auto [offset, number] = order_.front();
  const auto found = waiting_.find(offset);
  if (found == waiting_.end() || found->second.number != number) {  // nobody needs it any more
    order_.pop_front();
    done_.notify_all();
    return;
  }
  const Entry entry = found->second;
  is_writing_ = true;
  lock.unlock();
  const std::string problem = file_.write(offset, entry.data(), entry.bytes);
  lock.lock();
  is_writing_ = false;
  if (problem.empty()) {
    order_.pop_front();
    const auto now = waiting_.find(offset);
    if (now != waiting_.end() && now->second.number == number) {
      waiting_bytes_ -= entry.bytes;
      waiting_.erase(now);
    }
  } else {
    problem_ = problem;
  }
  done_.notify_all();
}

/// What cannot be read, or is damaged, shows when it is needed.
void PageQueue::readNext(std::unique_lock<std::mutex>& lock) {
  const PageSpan record = asked_.front();
  asked_.pop_front();
  if (wanted_.erase(record.offset) == 0 || isAhead(record.offset)) {  // it was asked for twice
    done_.notify_all();
    return;
  }
  reading_ = record.offset;
  is_reading_in_vain_ = false;
  lock.unlock();
  const auto bytes = std::make_shared<PageBytes>(record.bytes);
  bool is_short;
  const bool is_read = file_.read(record.offset, bytes->data(), record.bytes, is_short).empty();
  lock.lock();
  if (is_read && !is_reading_in_vain_) {
    read_.push_back(record.offset);
    ahead_[record.offset] = {bytes, 0, record.bytes, 0};
    ahead_bytes_ += record.bytes;
    dropAhead();
  }
  reading_ = kNothing;
  done_.notify_all();
}

/// The oldest go where there is no room for all.
void PageQueue::dropAhead() {
  while (!read_.empty() && (ahead_bytes_ > most_bytes_ || ahead_.count(read_.front()) == 0)) {
    if (const auto found = ahead_.find(read_.front()); found != ahead_.end()) {
      ahead_bytes_ -= found->second.bytes;
      ahead_.erase(found);
    }
    read_.pop_front();
  }
}

/// Not while something is written there, which would make the file longer again.
void PageQueue::shrink(uint64_t file_bytes) {
  std::unique_lock<std::mutex> lock(mutex_);
  waitUntil(lock, [this] { return !is_writing_; });
  file_.truncate(file_bytes);
}

void PageQueue::finish() {
  std::unique_lock<std::mutex> lock(mutex_);
  done_.wait(lock, [this] { return !hasWriting() && !hasReading(); });
}

size_t PageQueue::bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return waiting_bytes_ + ahead_bytes_;
}

}  // namespace dtsdf
