#include "log/log_reader.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "params/printable.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

const char kRemoved[] =
    ": it was removed, as the log has reached log/max_gb meanwhile; raise that, so that images "
    "stay until they are read";

uint64_t sizeOf(const std::string& path) {
  std::error_code error;
  const uint64_t bytes = fs::file_size(path, error);
  return error ? 0 : bytes;
}

bool isGone(const std::string& path) {
  return access(path.c_str(), F_OK) != 0 && (errno == ENOENT || errno == ENOTDIR);
}

/// The record at a place, if it is whole as far as its pixels' length goes.
std::optional<LogEntry> readAt(std::ifstream& file, const LogPlace& place) {
  std::array<uint8_t, kLogHeadBytes> bytes;
  file.clear();
  file.seekg(static_cast<std::streamoff>(place.offset));
  if (!file.read(reinterpret_cast<char*>(bytes.data()), bytes.size())) return std::nullopt;
  const std::optional<LogHead> head = decodeHead(bytes.data());
  if (!head) return std::nullopt;
  const uint64_t begin = place.offset + kLogHeadBytes, size = sizeOf(place.segment);
  if (size < begin || size - begin < head->description_bytes ||
      size - begin - head->description_bytes < head->pixel_bytes) {
    return std::nullopt;
  }
  LogEntry entry{*head, place, std::string(head->description_bytes, '\0')};
  if (!file.read(entry.description.data(), head->description_bytes)) return std::nullopt;
  if (!isWhole(bytes.data(), *head, entry.description)) return std::nullopt;
  return entry;
}

/// The beginning of a stretch and, by number, its last record.
struct Stretch {
  LogBegin begin;
  uint64_t first = 0, end = 0;  ///< Numbers; `end` is that of the record after the last one.
  size_t images = 0;
  std::vector<LogCorrection> corrections;
};

bool isImage(LogKind kind) { return kind == LogKind::kDepth || kind == LogKind::kColour; }

/// Nothing if it has no beginning.
std::optional<Stretch> survey(const LogStretchFolder& folder) {
  std::optional<Stretch> stretch;
  for (const std::string& segment : segmentsIn(folder.path)) {
    std::ifstream file(segment, std::ios::binary);
    uint64_t offset = 0;
    while (const std::optional<LogEntry> entry = readAt(file, {segment, offset})) {
      if (!stretch) {
        if (entry->head.kind != LogKind::kBegin) return std::nullopt;
        stretch.emplace();
        stretch->begin = readBegin(entry->description);
        stretch->first = stretch->end = entry->head.number;
        if (stretch->begin.has_map && sizeOf(baseMapOf(folder.path)) == 0) return std::nullopt;
      } else if (entry->head.number != stretch->end) {
        return stretch;  // something is missing before
      }
      if (entry->head.kind == LogKind::kCorrection) {
        stretch->corrections.push_back(readCorrection(entry->description));
      }
      if (isImage(entry->head.kind)) ++stretch->images;
      ++stretch->end;
      offset += kLogHeadBytes + entry->head.description_bytes + entry->head.pixel_bytes;
    }
  }
  return stretch;
}

bool isMoved(uint64_t number, const std::vector<LogCorrection>& corrections) {
  for (const LogCorrection& correction : corrections) {
    if (correction.first_moved < number) return true;
  }
  return false;
}

/// The stretches that lead to the newest map; the first is one that it can be made from.
std::vector<LogStretchFolder> chainOf(const std::string& folder) {
  const std::vector<LogStretchFolder> all = stretchesIn(folder);
  std::vector<LogStretchFolder> chain;  // the newest first
  std::vector<LogCorrection> corrections;
  size_t usable = 0;
  std::optional<Stretch> later;
  for (size_t i = all.size(); i-- > 0;) {
    std::optional<Stretch> stretch = survey(all[i]);
    if (!stretch || (!later && !stretch->begin.continues && stretch->images == 0)) {
      if (later) break;
      continue;  // nothing has happened in it
    }
    if (later && stretch->end != later->first) break;
    corrections.insert(corrections.end(), stretch->corrections.begin(), stretch->corrections.end());
    chain.push_back(all[i]);
    if (!stretch->begin.continues || !isMoved(stretch->first, corrections)) usable = chain.size();
    if (!stretch->begin.continues) break;
    later = std::move(stretch);
  }
  chain.resize(usable);
  return {chain.rbegin(), chain.rend()};
}

}  // namespace

LogReader::LogReader(const std::string& folder) : folder_(folder), stretches_(chainOf(folder)) {
  if (stretches_.empty() || !openStretch(0)) {
    throw std::runtime_error("'" + printable(folder) +
                             "' has no frame log that can be read from its "
                             "beginning");
  }
  const std::optional<LogEntry> first = read();
  if (!first || first->head.kind != LogKind::kBegin) {
    throw std::runtime_error("'" + printable(folder) + "' has no frame log with a beginning");
  }
  begin_ = readBegin(first->description);
  number_ = first->head.number + 1;
  bases_.push_back({first->head.number, begin_.has_map ? baseMapOf(stretches_.front().path) : ""});
  has_lost_images_ = begin_.continues || begin_.stands_for_lost;
}

bool LogReader::openStretch(size_t index) {
  if (index >= stretches_.size()) return false;
  stretch_ = index;
  segments_ = segmentsIn(stretches_[index].path);
  return openSegment(0);
}

bool LogReader::openSegment(size_t index) {
  if (index >= segments_.size()) return false;
  segment_ = index;
  offset_ = 0;
  file_ = std::ifstream(segments_[index], std::ios::binary);
  return file_.is_open();
}

std::optional<LogEntry> LogReader::read() {
  std::optional<LogEntry> entry = readAt(file_, {segments_[segment_], offset_});
  if (entry) offset_ += kLogHeadBytes + entry->head.description_bytes + entry->head.pixel_bytes;
  return entry;
}

/// To the next file, if there is one by now and this one has been read to its end.
bool LogReader::advance() {
  if (offset_ < sizeOf(segments_[segment_])) return false;
  const std::vector<std::string> segments = segmentsIn(stretches_[stretch_].path);
  if (segments.size() > segments_.size()) segments_ = segments;
  if (openSegment(segment_ + 1)) return true;
  if (stretch_ + 1 == stretches_.size()) {
    for (const LogStretchFolder& newer : stretchesIn(folder_)) {
      if (newer.index > stretches_.back().index) {
        stretches_.push_back(newer);
        break;
      }
    }
  }
  if (stretch_ + 1 == stretches_.size()) return false;
  const size_t before = stretch_, segment_before = segment_;
  const uint64_t offset_before = offset_;
  const std::vector<std::string> segments_before = segments_;
  if (openStretch(stretch_ + 1)) return true;
  stretch_ = before;
  segments_ = segments_before;
  openSegment(segment_before);
  offset_ = offset_before;
  return false;
}

std::optional<LogEntry> LogReader::next() {
  for (;;) {
    std::optional<LogEntry> entry = read();
    if (!entry) {
      if (!advance()) return std::nullopt;
      continue;
    }
    if (entry->head.number != number_) {  // what lies between them is missing
      offset_ = entry->place.offset;
      return std::nullopt;
    }
    ++number_;
    if (entry->head.kind != LogKind::kBegin) return entry;
    if (!readBegin(entry->description).has_map) continue;
    bases_.push_back({entry->head.number, baseMapOf(stretches_[stretch_].path)});
  }
}

std::string LogReader::cutOff() const {
  const uint64_t size = sizeOf(segments_[segment_]);
  if (offset_ >= size && stretch_ + 1 >= stretches_.size()) return "";
  return "the log is whole up to record " + std::to_string(number_ - 1) + "; what follows in '" +
         printable(segments_[segment_]) + "' (" + std::to_string(size - std::min(size, offset_)) +
         " bytes) is torn or damaged, and is left out";
}

LogRecord readRecord(const LogEntry& entry) {
  LogRecord record{entry.head.kind, entry.description, std::string(entry.head.pixel_bytes, '\0')};
  std::ifstream file(entry.place.segment, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(entry.place.offset + kLogHeadBytes +
                                         entry.head.description_bytes));
  if (!file.read(record.pixels.data(), static_cast<std::streamsize>(record.pixels.size()))) {
    throw std::runtime_error("cannot read '" + printable(entry.place.segment) + "'" +
                             (isGone(entry.place.segment) ? kRemoved : ""));
  }
  if (!isWhole(entry.head, record.pixels)) {
    throw std::runtime_error("record " + std::to_string(entry.head.number) + " in '" +
                             printable(entry.place.segment) + "' is damaged");
  }
  return record;
}

}  // namespace dtsdf
