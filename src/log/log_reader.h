/// Reads a frame log, also while it is written.
#pragma once

#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "log/log_folder.h"
#include "log/log_record.h"

namespace dtsdf {

/// Where a record lies.
struct LogPlace {
  std::string segment;
  uint64_t offset = 0;
};

/// A record without its pixels.
struct LogEntry {
  LogHead head;
  LogPlace place;
  std::string description;
};

/// A map in a log, which the records before have led to.
struct LogBase {
  uint64_t number = 0;  ///< Records with a higher one go into it.
  std::string path;     ///< Its file; empty: it is empty.
};

/// Hands out the records of a log in order, from the first stretch on that the newest map can be
/// made from. One thread at a time.
class LogReader {
 public:
  /// @throws std::runtime_error if the folder has no log, or none with a beginning.
  explicit LogReader(const std::string& folder);

  /// The map that the first record goes into.
  const LogBegin& begin() const { return begin_; }
  /// Of the record that is read next.
  uint64_t nextNumber() const { return number_; }
  /// File of that map; empty: it is empty.
  const std::string& baseMap() const { return bases_.front().path; }
  /// That map, and those that stretches which were read so far begin with.
  const std::vector<LogBase>& bases() const { return bases_; }
  /// Whether images that led to that map are no longer in the log.
  bool hasLostImages() const { return has_lost_images_; }

  /// The next record; nothing where the log ends, as far as it is written. Of a stretch that
  /// continues the one before, kBegin is passed over.
  std::optional<LogEntry> next();

  /// Once next() has nothing: what of a log that nobody writes any more cannot be read; empty if
  /// nothing.
  std::string cutOff() const;

 private:
  bool openSegment(size_t index);
  bool openStretch(size_t index);
  std::optional<LogEntry> read();
  bool advance();

  std::string folder_;
  std::vector<LogStretchFolder> stretches_;
  size_t stretch_ = 0;
  std::vector<std::string> segments_;
  size_t segment_ = 0;
  uint64_t offset_ = 0;
  std::ifstream file_;
  uint64_t number_ = 0;  ///< Of the next record.

  LogBegin begin_;
  std::vector<LogBase> bases_;
  bool has_lost_images_ = false;
};

/// A record with its pixels. @throws std::runtime_error if it cannot be read, or is damaged.
LogRecord readRecord(const LogEntry& entry);

}  // namespace dtsdf
