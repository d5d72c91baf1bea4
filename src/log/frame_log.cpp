#include "log/frame_log.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "dtsdf_mapping/io/map_file.h"
#include "log/log_folder.h"
#include "params/printable.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

/// Of the bound, so that what is dropped at once is a part of the log and not all of it.
constexpr uint64_t kStretchesWithinBound = 4;

std::string reasonOf(int error_number) { return std::generic_category().message(error_number); }

int lockFolder(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  const std::string path = folder + "/lock";
  const int lock = error ? -1 : open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock < 0) {
    throw std::runtime_error("cannot log to '" + printable(folder) +
                             "': " + reasonOf(error ? error.value() : errno) +
                             "; set log/folder to one that can be written");
  }
  if (flock(lock, LOCK_EX | LOCK_NB) == 0) return lock;
  close(lock);
  throw std::runtime_error("cannot log to '" + printable(folder) +
                           "': another process logs there; set log/folder to another one");
}

}  // namespace

FrameLog::FrameLog(Options options)
    : options_([&] {
        if (!options.write) options.write = ::write;
        return std::move(options);
      }()),
      lock_(lockFolder(options_.folder)) {
  for (const LogStretchFolder& old : stretchesIn(options_.folder)) {
    Stretch stretch;
    stretch.path = old.path;
    stretch.bytes = bytesIn(old.path);
    stretches_.push_back(stretch);
    next_stretch_ = old.index + 1;
  }
}

FrameLog::~FrameLog() {
  closeSegment();
  if (lock_ >= 0) close(lock_);
}

WriteMap writerOf(std::shared_ptr<const MapContents> contents) {
  if (contents == nullptr) return nullptr;
  return [contents = std::move(contents)](const std::string& path) { saveMap(*contents, path, 1); };
}

void FrameLog::begin(LogBegin begin, const WriteMap& write_map) {
  const bool was_whole = isWhole();
  closeSegment();
  begin.continues = begin.continues && was_whole;
  begin.stands_for_lost = begin.stands_for_lost && !begin.continues;
  begin.has_map = write_map != nullptr;
  if (!begin.continues) {
    ++life_;
    number_ = 0;
  }
  for (Stretch& stretch : stretches_) {
    stretch.is_of_this_map = stretch.is_of_this_map && begin.continues;
  }
  Stretch stretch;
  stretch.path = stretchName(options_.folder, next_stretch_++);
  stretch.first_number = number_;
  stretch.is_of_this_map = true;
  stretch.continues = begin.continues;
  std::error_code error;
  if (!fs::create_directory(stretch.path, error) && error) fail(stretch.path, error.value());
  stretches_.push_back(stretch);
  if (write_map) write_map(baseMapOf(stretch.path));
  stretches_.back().bytes = bytesIn(stretch.path);
  segment_index_ = 0;
  openSegment();
  write(toRecord(begin));
}

void FrameLog::openSegment() {
  closeSegment();
  segment_path_ = segmentName(stretches_.back().path, ++segment_index_);
  descriptor_ = open(segment_path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  segment_bytes_ = 0;
  if (descriptor_ < 0) fail(segment_path_, errno);
}

void FrameLog::closeSegment() noexcept {
  if (descriptor_ >= 0) close(descriptor_);
  descriptor_ = -1;
}

void FrameLog::fail(const std::string& path, int error_number) {
  closeSegment();
  throw std::runtime_error("cannot write '" + printable(path) + "': " + reasonOf(error_number));
}

void FrameLog::add(const LogRecord& record) {
  if (!isWhole()) throw std::logic_error("the log lacks what came before");
  if (segment_bytes_ >= options_.segment_bytes) openSegment();
  write(record);
}

void FrameLog::add(const LogRecord& record, double stamp_s) {
  add(record);
  std::optional<double>& first = stretches_.back().first_stamp_s;
  if (!first) first = stamp_s;
}

/// A stretch whose map has images that were moved is no place to begin any more.
void FrameLog::add(const LogRecord& record, const LogCorrection& correction) {
  add(record);
  for (Stretch& stretch : stretches_) {
    if (stretch.continues && stretch.first_number > correction.first_moved) {
      stretch.is_outdated = true;
    }
  }
}

void FrameLog::write(const LogRecord& record) {
  writeAll(encodeRecord(record, number_) + record.pixels);
  ++number_;
  keepWithin();
}

void FrameLog::writeAll(const std::string& bytes) {
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written = options_.write(descriptor_, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(segment_path_, written < 0 ? errno : ENOSPC);
    done += static_cast<size_t>(written);
  }
  segment_bytes_ += bytes.size();
  stretches_.back().bytes += bytes.size();
  stretches_.back().record_bytes += bytes.size();
}

/// The newest stretch stays, until another one is begun; where even that is too much, the log is at
/// its end.
void FrameLog::keepWithin() {
  while (bytes() > options_.max_bytes && stretches_.size() > 1) {
    removeStretch(stretches_.front().path);
    stretches_.pop_front();
  }
  if (bytes() <= options_.max_bytes) return;
  closeSegment();
  throw std::runtime_error(
      "the log has reached log/max_gb with a single map and what followed it; "
      "raise log/max_gb");
}

bool FrameLog::wantsMap() const {
  return !isWhole() || start() == stretches_.size() ||
         stretches_.back().record_bytes > options_.max_bytes / kStretchesWithinBound;
}

uint64_t FrameLog::bytes() const {
  uint64_t bytes = 0;
  for (const Stretch& stretch : stretches_) bytes += stretch.bytes;
  return bytes;
}

/// The first stretch that the map as it is can be made from; their number if there is none.
size_t FrameLog::start() const {
  size_t i = 0;
  while (i < stretches_.size() && (!stretches_[i].is_of_this_map || stretches_[i].is_outdated)) ++i;
  return i;
}

std::optional<double> FrameLog::firstStamp_s() const {
  for (size_t i = start(); i < stretches_.size(); ++i) {
    if (stretches_[i].first_stamp_s) return stretches_[i].first_stamp_s;
  }
  return std::nullopt;
}

}  // namespace dtsdf
