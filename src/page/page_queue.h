/// Writes records to a page file on a thread of its own, and reads ahead what may be needed soon:
/// whoever asks waits only where too much waits to be written, or what is needed has not come yet.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "map/record_bytes.h"
#include "page/page_file.h"

namespace dtsdf {

/// A record in a page file.
struct PageSpan {
  uint64_t offset = 0;
  size_t bytes = 0;
  /// Where its checksum is kept until the record is forgotten: written with it, and compared where
  /// it is read ahead.
  uint64_t* checksum = nullptr;
};

uint64_t checksumOf(const char* record, size_t bytes);

/// How often and how long someone waited for the disk.
struct DiskWaits {
  uint64_t count = 0;
  double ms = 0.0;
};

/// Adds its own life to them.
class WaitTimer {
 public:
  explicit WaitTimer(DiskWaits& waits) : waits_(waits) { ++waits_.count; }
  ~WaitTimer() {
    waits_.ms +=
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_)
            .count();
  }

 private:
  DiskWaits& waits_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// One thread at a time uses it.
class PageQueue {
 public:
  /// @param most_bytes What may wait to be written, and as much again what was read ahead.
  PageQueue(PageFile& file, size_t most_bytes);
  /// What waits is not written: nobody can read it any more.
  ~PageQueue();

  /// Takes records that lie in memory back to back; from now on they can be found. Waits until
  /// there is room for them. After a failure, what failed is tried again first.
  /// @return what is wrong; empty: they were taken. What was taken before stays in memory, and can
  /// be found, until it could be written.
  /// @throws std::bad_alloc and then may have taken some of them: see forget().
  std::string write(const std::vector<PageSpan>& records, const SharedRecords& bytes);

  /// A record in memory, which stays while somebody holds it.
  struct Entry {
    RecordPlace place;
    size_t bytes = 0;
    uint64_t number = 0;
    uint64_t* checksum = nullptr;
  };

  /// Records that wait to be written, or were read ahead and are what was written; those that are
  /// neither have no place.
  std::vector<RecordPlace> find(const std::vector<PageSpan>& records) const;

  /// Nobody needs any more what lies at so many offsets, offset_of(i).
  template <class OffsetOf>
  void forget(size_t count, const OffsetOf& offset_of) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      for (size_t i = 0; i < count; ++i) forgetOne(offset_of(i));
    }
    done_.notify_all();
  }

  /// Reads these records next, in place of those asked for before, as many as there is room for.
  void readAhead(const std::vector<PageSpan>& records, const RecordsMaker& make);

  /// Gives what lies beyond back to the disk, after what is written now. @pre Nobody needs it any
  /// more.
  void shrink(uint64_t file_bytes);

  /// Waits until nothing waits to be written, or it cannot be, and all is read that was asked for.
  void finish();

  size_t bytes() const;                              ///< Of memory.
  const DiskWaits& waits() const { return waits_; }  ///< Of write().

 private:
  void run();
  void writeNext(std::unique_lock<std::mutex>& lock);
  void readNext(std::unique_lock<std::mutex>& lock);
  template <class Test>
  void waitUntil(std::unique_lock<std::mutex>& lock, const Test& test);
  void shrinkNow(std::unique_lock<std::mutex>& lock);
  std::vector<Entry> nextToWrite();
  std::vector<PageSpan> nextToRead();
  void forgetOne(uint64_t offset);
  bool isAhead(uint64_t offset) const;
  bool hasWriting() const { return problem_.empty() && !order_.empty(); }
  bool hasReading() const { return !asked_.empty() || !reading_.empty(); }
  bool hasShrinking() const { return shrink_to_ != kNothing || is_shrinking_; }
  void dropAhead(uint64_t offset);
  void dropOldestAhead();
  void fail(bool reads, const std::string& problem);

  PageFile& file_;
  const size_t most_bytes_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  std::condition_variable to_do_, done_;
  std::unordered_map<uint64_t, Entry> waiting_;          ///< By offset.
  std::deque<std::pair<uint64_t, uint64_t>> order_;      ///< Offsets and numbers, as they came.
  std::unordered_map<uint64_t, Entry> ahead_;            ///< What was read, by offset,
  std::unordered_map<const RecordBytes*, size_t> held_;  ///< and how much of it memory holds.
  std::deque<PageSpan> asked_;                           ///< What is to be read,
  std::unordered_set<uint64_t> wanted_;                  ///< but for what was forgotten since.
  std::deque<uint64_t> read_;                            ///< What was, the oldest first.
  size_t waiting_bytes_ = 0;
  size_t ahead_bytes_ = 0;  ///< Of memory that records share.
  uint64_t last_number_ = 0;
  RecordsMaker make_;                     ///< For what is read,
  std::unordered_set<uint64_t> reading_;  ///< which is this, but for what was forgotten since.
  uint64_t shrink_to_ = kNothing;         ///< What the file is to be cut to.
  std::string problem_;  ///< Of the record that comes next: nothing is written until write().
  bool ends_ = false;
  bool is_shrinking_ = false;
  DiskWaits waits_;  ///< Of whoever uses it.
  std::thread thread_;

  static constexpr uint64_t kNothing = ~uint64_t{0};
};

}  // namespace dtsdf
