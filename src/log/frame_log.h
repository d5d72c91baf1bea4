/// Writes the frame log: all that a map is made of, on disk, in bounded space.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "dtsdf_mapping/map_contents.h"
#include "log/log_record.h"

namespace dtsdf {

/// write(2), or what stands for it in tests.
using LogWrite = std::function<ssize_t(int descriptor, const void* data, size_t bytes)>;

/// Writes the map that a stretch begins with to a path. Null: it is empty.
using WriteMap = std::function<void(const std::string& path)>;

/// That of contents; null for none.
WriteMap writerOf(std::shared_ptr<const MapContents> contents);

/// A place in the log.
struct LogMark {
  uint64_t life = 0;    ///< Counts how often the log has begun anew, and the numbers with it.
  uint64_t number = 0;  ///< Of the record that comes there.
};

/// One thread at a time. Each record goes to its file by one write, so that a process that is
/// killed leaves all of them but the one that it was writing.
///
/// The log is in stretches, each with a map at its beginning: a new one where the map is emptied or
/// loaded, and, so that the oldest can go, wherever the newest has taken a quarter of the bound.
class FrameLog {
 public:
  struct Options {
    std::string folder;
    uint64_t max_bytes = 0;
    uint64_t segment_bytes = 64u << 20;
    LogWrite write;  ///< Empty: write(2).
  };

  /// Makes the folder, and locks it. @throws std::runtime_error if another process logs to it, or
  /// it cannot be written.
  explicit FrameLog(Options options);
  ~FrameLog();
  FrameLog(const FrameLog&) = delete;
  FrameLog& operator=(const FrameLog&) = delete;

  /// Begins a stretch with a map. `begin.continues` holds only where nothing was
  /// lost: see isWhole(). @throws std::runtime_error if it cannot be written; isWhole() is false
  /// then.
  void begin(LogBegin begin, const WriteMap& write_map);

  /// Adds what happened to the map. @pre isWhole().
  /// @throws std::runtime_error if it cannot be written; isWhole() is false then.
  void add(const LogRecord& record);

  /// The same, and an image's stamp, by which it is known from when on the map can be corrected.
  void add(const LogRecord& record, double stamp_s);

  /// The same of a correction.
  void add(const LogRecord& record, const LogCorrection& correction);

  /// Whether the newest stretch has all that has happened to the map since it began.
  bool isWhole() const { return descriptor_ >= 0; }

  /// Whether a new stretch is needed: with the map as it is now.
  bool wantsMap() const;

  /// The number that the next record gets.
  uint64_t nextNumber() const { return number_; }
  /// Where that comes.
  LogMark mark() const { return {life_, number_}; }

  uint64_t bytes() const;

  /// Stamp of the first image from which on the map can be corrected; none before there is one.
  std::optional<double> firstStamp_s() const;

 private:
  struct Stretch {
    std::string path;
    uint64_t bytes = 0;
    uint64_t record_bytes = 0;  ///< Those without the map.
    uint64_t first_number = 0;
    bool is_of_this_map = false;  ///< What it holds has led to the map as it is.
    bool continues = false;
    bool is_outdated = false;  ///< Its map has images whose poses were corrected since.
    std::optional<double> first_stamp_s = std::nullopt;
  };

  void openSegment();
  void closeSegment() noexcept;
  void write(const LogRecord& record);
  void writeAll(const std::string& bytes);
  void keepWithin();
  size_t start() const;
  [[noreturn]] void fail(const std::string& path, int error_number);

  const Options options_;
  int lock_ = -1;
  int descriptor_ = -1;  ///< Of the segment that is written; -1: there is none.
  std::string segment_path_;
  uint64_t segment_index_ = 0, segment_bytes_ = 0, next_stretch_ = 1;
  uint64_t life_ = 0, number_ = 0;
  std::deque<Stretch> stretches_;
};

}  // namespace dtsdf
