/// Stores records in an unnamed file, whose space the system frees even if the process crashes. A
/// helper thread writes the records, so callers wait only if it falls behind. A checksum detects
/// damaged records.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "page/free_runs.h"
#include "threads/helper.h"

namespace dtsdf {

/// Where a record is in the file.
struct StoredRecord {
  static constexpr uint64_t kUnitBytes = 256;  ///< A record takes a whole number of these units.

  uint64_t number;  ///< Number of the write. Included in the checksum to detect stale records.
  uint32_t unit;    ///< First unit in the file.
  uint32_t bytes;

  uint64_t offset() const { return unit * kUnitBytes; }
};

/// A record in memory: its pieces, and the owner that keeps them alive.
struct RecordBytes {
  std::shared_ptr<const void> owner;
  std::string_view pieces[3] = {};

  size_t size() const { return pieces[0].size() + pieces[1].size() + pieces[2].size(); }
  void copyTo(std::vector<char>& to) const;
};

/// Thread-safe.
class RecordStore {
 public:
  enum class Reading {
    kIntact,      ///< The record is as it was written.
    kDamaged,     ///< It has changed, or cannot be read although the disk responds: it is lost.
    kUnreadable,  ///< The disk did not respond; a later read may succeed.
  };

  /// Creates the folder if it is missing.
  /// @param max_waiting Maximum number of bytes that may wait to be written. If none are waiting, a
  /// record of any size is accepted.
  /// @throws std::runtime_error if no file can be created there.
  RecordStore(const std::string& folder, uint64_t max_bytes, size_t max_waiting);
  ~RecordStore();
  RecordStore(const RecordStore&) = delete;
  RecordStore& operator=(const RecordStore&) = delete;

  /// Accepts a record, which can then be read. If the disk refuses the record, it stays in memory,
  /// a failure is counted, and the next call tries to write it again.
  /// @return none if the disk refuses records and too many bytes are waiting, or if the file is
  /// full.
  std::optional<StoredRecord> write(RecordBytes record);
  Reading read(const StoredRecord& record, std::vector<char>& to);

  /// Whether the disk responded to the last read.
  bool diskResponds() const { return disk_responds_; }

  /// Asks the system to read a record in the background.
  void readAhead(const StoredRecord& record) const;

  void erase(const StoredRecord& record) noexcept;
  void clear() noexcept;

  size_t waitingBytes() const;  ///< Bytes waiting to be written.

  void countLost();  ///< Counts a record that its owner gave up.
  /// Counts a wait for the disk since `start`, if it took at least a millisecond.
  void noteWait(std::chrono::steady_clock::time_point start);
  void resetCounts();
  PageStats stats() const;  ///< Without block counts; index_bytes includes waiting records.

 private:
  using Lock = std::unique_lock<std::mutex>;

  void startWriting();
  void writeWaiting();
  std::string writeOne(uint64_t number, const RecordBytes& record, uint64_t offset,
                       std::vector<char>& buffer) const;
  std::string transfer(const StoredRecord& record, std::vector<char>& to) const;
  void note(std::string problem);
  void emptyUnusedFile() noexcept;

  const std::string folder_;
  const size_t max_waiting_;
  int file_ = -1;
  std::atomic<bool> disk_responds_{true};
  mutable std::mutex mutex_;  ///< Guards the members below.
  std::condition_variable changed_;
  std::condition_variable tried_;  ///< Notified after each attempt to write a record.
  FreeRuns runs_;
  PageStats stats_;
  uint64_t last_number_ = 0;
  /// Records waiting to be written, and their offsets in the file, by number.
  std::map<uint64_t, std::pair<RecordBytes, uint64_t>> waiting_;
  size_t waiting_bytes_ = 0;
  uint64_t writing_ = 0;       ///< The record that is being written; 0 if none is.
  bool is_writing_ = false;    ///< Whether the helper is writing.
  bool disk_refuses_ = false;  ///< Whether its last attempt failed.
  Helper helper_;              ///< Last, so that it ends before the members it uses.
};

}  // namespace dtsdf
