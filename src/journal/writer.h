/// Writes a journal on its own thread, so that fusion does not wait for compression or the disk.
#pragma once

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "io/map_chunks.h"
#include "journal/records.h"

namespace dtsdf {

/// The state of a journal.
struct JournalReport {
  uint64_t bytes = 0;          ///< Size of the file.
  uint64_t waiting_bytes = 0;  ///< Size of the images waiting to be written.
  std::string problem;         ///< Why and when writing stopped; empty if it has not.
};

/// Creates a file for each map, and changes no other file in the folder. If writing fails or a
/// limit is reached, the writer stops and reports this, until the next begin().
///
/// Thread-safe. Errors while writing are reported, not thrown.
class JournalWriter {
 public:
  struct Options {
    std::string folder;
    uint64_t max_bytes = 0;           ///< Limit for all journals in the folder.
    size_t max_waiting = 256u << 20;  ///< Limit for JournalReport::waiting_bytes.
    /// write(2), or a replacement in tests.
    std::function<ssize_t(int descriptor, const void* data, size_t bytes)> write = ::write;
    std::function<int(int descriptor)> sync = ::fdatasync;  ///< fdatasync(2), or a replacement.
  };

  /// Creates the folder and the file. @throws std::runtime_error if this fails.
  explicit JournalWriter(Options options);
  /// Writes all waiting entries.
  ~JournalWriter();

  /// Path of the newest file.
  std::string path() const;

  /// Begins a new map: a copy of `map`, or an empty map if null. All but the first begin a new
  /// file.
  void begin(const journal::Begin& begin, std::shared_ptr<const MapChunks> map = nullptr);

  /// Adds a change to the map.
  void add(journal::Call call);

  /// Number of calls added since begin(), excluding lost calls.
  uint64_t count() const;
  /// Becomes ready when all entries added so far have been processed; true unless writing has
  /// stopped.
  std::future<bool> written();

  JournalReport report() const;

 private:
  struct Entry {
    std::function<void()> write;  ///< Runs on the writer's thread; may throw. Null: discarded.
    size_t bytes = 0;
    bool begins = false;
    std::optional<std::promise<bool>> written;  ///< Set instead of `write`.
  };

  void openFile();
  void push(Entry entry);
  void loop();
  void write(const Entry& entry);
  void writeBegin(const journal::Begin& begin, const MapChunks* map);
  void append(const Bytes& records);
  [[noreturn]] void throwCannotWrite(int error_number) const;
  void stop(const std::string& why);

  const Options options_;
  // Used only by the writer's thread, once it runs.
  int descriptor_ = -1;
  bool has_begun_ = false;  ///< Whether the file contains the beginning of a map.
  std::chrono::steady_clock::time_point synced_ = std::chrono::steady_clock::now();
  uint64_t other_journals_bytes_ = 0;  ///< Size of other journals in the folder.
  uint64_t whole_bytes_ = 0;           ///< End of the last complete record.
  size_t records_ = 0;                 ///< Twice the number of calls to append() for the file.

  mutable std::mutex mutex_;  ///< Guards the members below.
  std::string path_;          ///< Changed only by the writer's thread.
  std::condition_variable changed_;
  std::deque<Entry> entries_;
  size_t waiting_bytes_ = 0;
  bool is_ending_ = false;
  bool is_stopped_ = false;  ///< New entries are discarded until begin().
  uint64_t count_ = 0;
  JournalReport report_;
  std::thread thread_;
};

}  // namespace dtsdf
