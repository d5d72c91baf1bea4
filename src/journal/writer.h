/// Writes a journal on a thread of its own: who fuses waits neither for codes nor for the disk.
#pragma once

#include <unistd.h>

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

/// What is known of a journal.
struct JournalReport {
  uint64_t bytes = 0;                   ///< Size of the file.
  uint64_t waiting_bytes = 0;           ///< Size of images that wait for the disk.
  std::optional<double> first_stamp_s;  ///< Stamp of the first image that can be corrected.
  uint64_t lost = 0;                    ///< Images and calls that were not written.
  std::string problem;                  ///< Why some are lost, and since when; empty: none are.
};

/// One file per writer, with a name of its own: no other file of the folder is touched. Where it
/// cannot be written, or the folder holds as much as it may, it stops for the rest of the map, and
/// says so; clear() and load() try again.
///
/// Thread safe; never throws at whoever writes.
class JournalWriter {
 public:
  struct Options {
    std::string folder;
    uint64_t max_bytes = 0;           ///< Limit for all journals of the folder.
    size_t max_waiting = 256u << 20;  ///< Limit for the bytes of images that wait.
    /// write(2), or what stands for it in tests.
    std::function<ssize_t(int descriptor, const void* data, size_t bytes)> write = ::write;
  };

  /// Makes the folder and the file. @throws std::runtime_error if that is not possible.
  explicit JournalWriter(Options options);
  /// What waits is written.
  ~JournalWriter();

  const std::string& path() const { return path_; }

  /// The map became another one: that of a file, or an empty one.
  void begin(const journal::Begin& begin, std::shared_ptr<const MapChunks> map = nullptr);

  /// Something happened to the map.
  void add(journal::Call call);

  /// Records since begin(), images as one.
  uint64_t count() const;
  /// Whether all that was added so far is in the file, once it is.
  std::future<bool> written();

  JournalReport report() const;

 private:
  struct Entry {
    std::function<void()> write;  ///< On the thread; throws std::exception.
    size_t bytes = 0;
    bool begins = false;
    std::optional<double> stamp_s;              ///< Stamp of an image that can be corrected.
    std::optional<std::promise<bool>> written;  ///< Set in place of `write`.
  };

  void openFile();
  void push(Entry entry);
  void loop();
  void write(const Entry& entry);
  void writeBegin(const journal::Begin& begin, const MapChunks* map);
  void append(const void* data, size_t bytes, size_t records);
  void stop(const std::string& why);

  const Options options_;
  std::string path_;
  int descriptor_ = -1;
  uint64_t bytes_of_others_ = 0;  ///< Journals in the folder.
  uint64_t whole_bytes_ = 0;      ///< The thread's: where the last whole record ends.
  size_t records_ = 0;            ///< The thread's: in the file.

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::condition_variable changed_;
  std::deque<Entry> entries_;
  size_t waiting_bytes_ = 0;
  bool is_ending_ = false;
  bool is_stopped_ = false;  ///< What is pushed now is lost, until begin().
  bool can_go_on_ = true;    ///< False once the file may end within a record.
  uint64_t count_ = 0;
  JournalReport report_;
  std::thread thread_;
};

}  // namespace dtsdf
