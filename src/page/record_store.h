/// Records in a file without a name: nobody else opens it, and however the process ends, the system
/// takes its space back. The system's cache writes behind and reads ahead; a checksum finds what
/// did not come back as it was.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "page/free_runs.h"

namespace dtsdf {

/// What became of what lies on disk, since the start or the last clear.
struct PagedStats {
  size_t bytes = 0;        ///< Of the disk.
  size_t index_bytes = 0;  ///< Of memory, that it takes to know of it, about.
  uint64_t failures = 0;   ///< Reads and writes that failed, or found the folder full.
  uint64_t lost = 0;       ///< Records that did not come back as they were.
  std::string problem;     ///< What the last failure was; empty: there was none.
  uint64_t waits = 0;      ///< See DiskWait.
  double wait_ms = 0.0;
};

/// Where a record is, and what it has to be.
struct StoredRecord {
  uint64_t offset;
  uint64_t checksum;
  uint32_t bytes;
};

/// For one thread at a time.
class RecordStore {
 public:
  enum class Reading {
    kIntact,      ///< It is what was written.
    kDamaged,     ///< It is not, or the file ends before it: it is lost, which is counted.
    kUnreadable,  ///< The disk did not give it after some tries; it may the next time.
  };

  /// Makes the folder where it is missing.
  /// @throws std::runtime_error where no file can be made there.
  RecordStore(const std::string& folder, uint64_t max_bytes);
  ~RecordStore();
  RecordStore(const RecordStore&) = delete;
  RecordStore& operator=(const RecordStore&) = delete;

  /// @return none where the disk does not take it, which is counted.
  std::optional<StoredRecord> write(const char* from, size_t bytes);
  Reading read(const StoredRecord& record, char* to);

  /// The system reads it while others go on.
  void readAhead(const StoredRecord& record) const;

  /// Gives its space back.
  void erase(const StoredRecord& record) noexcept;
  void clear() noexcept;

  /// How much more may be written.
  uint64_t room() const;

  /// Counts a failure of one who uses it; a record that nobody will get any more.
  void fail(const std::string& problem);
  void countLost() { ++stats_.lost; }
  void countFull();
  void resetCounts() { stats_ = PagedStats(); }
  PagedStats stats() const;

 private:
  friend class DiskWait;

  std::string transfer(const StoredRecord& record, char* to, bool& is_short) const;
  void shrink() noexcept;

  const std::string folder_;
  const uint64_t max_bytes_;
  int file_ = -1;
  FreeRuns runs_;
  uint64_t file_end_ = 0;
  bool may_pause_ = true;  ///< Between tries of a read: the last one did not fail.
  PagedStats stats_;
};

/// Counts its own life as a wait for the disk, if that was long enough to be felt.
class DiskWait {
 public:
  explicit DiskWait(RecordStore& store) : store_(store) {}
  ~DiskWait();
  DiskWait(const DiskWait&) = delete;
  DiskWait& operator=(const DiskWait&) = delete;

 private:
  RecordStore& store_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace dtsdf
