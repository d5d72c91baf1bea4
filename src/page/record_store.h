/// Records in a file without a name: nobody else opens it, and however the process ends, the system
/// takes its space back. A helper writes them, so that callers wait only where it is behind; a
/// checksum finds what did not come back as it was.
#pragma once

#include <array>
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
#include <utility>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "page/free_runs.h"
#include "threads/helper.h"

namespace dtsdf {

/// Where a record is.
struct StoredRecord {
  static constexpr uint64_t kUnitBytes =
      256;  ///< Unit of the file's space, up to which it is filled.

  uint64_t number;  ///< Number of the write, in the checksum: no older record passes for this.
  uint32_t unit;    ///< The first one in the file.
  uint32_t bytes;

  uint64_t offset() const { return unit * kUnitBytes; }
};

/// A record in memory: its pieces, and what keeps them there.
struct RecordBytes {
  struct Piece {
    const void* from = nullptr;
    size_t bytes = 0;
  };
  std::shared_ptr<const void> owner;
  Piece pieces[3] = {};

  size_t size() const { return pieces[0].bytes + pieces[1].bytes + pieces[2].bytes; }
  void copyTo(std::vector<char>& to) const;
};

/// Any thread may use it.
class RecordStore {
 public:
  enum class Reading {
    kIntact,      ///< It is what was written.
    kDamaged,     ///< It is not, or cannot be read where the disk gives others: it is lost.
    kUnreadable,  ///< The disk gives nothing, after some tries; it may the next time.
  };

  /// Makes the folder where it is missing.
  /// @param most_waiting Bytes that may wait to be written, beside one record.
  /// @throws std::runtime_error where no file can be made there.
  RecordStore(const std::string& folder, uint64_t max_bytes, size_t most_waiting);
  ~RecordStore();
  RecordStore(const RecordStore&) = delete;
  RecordStore& operator=(const RecordStore&) = delete;

  /// Takes a record, which can be read from here on, or throws std::bad_alloc. What the disk does
  /// not take stays in memory, is counted as a failure, and tried again by the next call.
  /// @return none where too much waits for a disk that takes none, or the file is full.
  std::optional<StoredRecord> write(RecordBytes record);
  Reading read(const StoredRecord& record, std::vector<char>& to);

  /// Whether the disk gave something when it was asked last.
  bool gives() const { return gives_; }

  /// The system reads it while others go on.
  void readAhead(const StoredRecord& record) const;

  /// Gives its space back.
  void erase(const StoredRecord& record) noexcept;
  void clear() noexcept;

  size_t waitingBytes() const;  ///< To be written.

  /// Counts a failure of one who uses it; a record that nobody will get any more.
  void fail(std::string problem);
  void countLost();
  /// Counts a wait for the disk since then, if it was long enough to be felt.
  void noteWait(std::chrono::steady_clock::time_point start);
  void resetCounts();
  PageStats stats() const;  ///< But for counts of blocks; index_bytes has what waits.

 private:
  using Lock = std::unique_lock<std::mutex>;

  /// To be written.
  struct Waiting {
    RecordBytes record;
    uint64_t offset;
  };

  /// Records are written some at a time, as to lock and to unlock takes as long as to write one.
  static constexpr size_t kWrittenAtOnce = 64;
  using Batch = std::array<std::pair<uint64_t, const Waiting*>, kWrittenAtOnce>;

  void startWriting();
  void writeWaiting();
  size_t findWaiting(uint64_t after, Batch& batch) const;
  void forgetWritten(const Batch& batch, size_t count);
  std::string writeOne(uint64_t number, const Waiting& waiting, std::vector<char>& buffer) const;
  std::string transfer(const StoredRecord& record, std::vector<char>& to) const;
  void note(std::string problem);
  void shrink() noexcept;

  const std::string folder_;
  const size_t most_waiting_;
  int file_ = -1;
  std::atomic<bool> gives_{true};
  std::atomic<uint64_t> written_{0};  ///< None up to this number waits.
  mutable std::mutex mutex_;          ///< Guards what follows.
  std::condition_variable changed_;
  FreeRuns runs_;
  uint64_t file_end_ = 0;
  PageStats stats_;
  uint64_t last_number_ = 0;
  std::map<uint64_t, Waiting> waiting_;  ///< By number.
  size_t waiting_bytes_ = 0;
  uint64_t writing_ = 0;     ///< Those up to this number are written now; 0: none.
  bool is_writing_ = false;  ///< The helper is at it.
  bool is_clearing_ = false, disk_refuses_ = false;  ///< It stops; its last try failed.
  Helper helper_;                                    ///< Ends before what it works on.
};

}  // namespace dtsdf
