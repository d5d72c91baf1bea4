#include "page/record_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "params/printable.h"

namespace dtsdf {
namespace {

constexpr uint64_t kUnitBytes = StoredRecord::kUnitBytes;

/// Number of attempts to read a record, with pauses of 1, 2, 4 and 8 ms, so that a temporary
/// failure loses nothing. If the disk did not respond to the last read, there is only one attempt.
constexpr int kTries = 5;

constexpr double kMinWait_ms = 1.0;

/// The helper stops after the disk refused this many records in a row. It wakes waiting threads
/// after each group of this many records, since every time costs a context switch.
constexpr int kGroup = 64;

/// Size of the checksum after each record.
constexpr size_t kSumBytes = sizeof(uint64_t);

constexpr const char* kFull = "a file in map/page_folder is full; raise map/page_max_gb";

using Clock = std::chrono::steady_clock;

void countWait(Clock::time_point start, PageStats& stats) {
  const double ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  if (ms < kMinWait_ms) return;
  ++stats.waits;
  stats.wait_ms += ms;
}

uint64_t unitsOf(size_t bytes) { return (bytes + kSumBytes + kUnitBytes - 1) / kUnitBytes; }

std::string textOf(int error) { return std::generic_category().message(error); }

/// Opens a file without a name. If the file system does not support that, a named file is opened
/// and unlinked immediately.
int openUnnamed(const std::string& folder) {
  const int file = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL)) return file;
  std::string path = folder + "/dtsdf_pages_XXXXXX";
  const int named = mkostemp(path.data(), O_CLOEXEC);
  if (named >= 0) unlink(path.c_str());
  return named;
}

/// Calls call(address, size, offset) until all bytes are transferred, or a call fails or transfers
/// none. @return what the last call returned.
template <class Byte, class Call>
ssize_t transferAll(Byte* bytes, size_t size, uint64_t offset, const Call& call) {
  ssize_t done = 1;
  while (size > 0 && (done > 0 || (done < 0 && errno == EINTR))) {
    done = call(bytes, size, static_cast<off_t>(offset));
    if (done <= 0) continue;
    bytes += done;
    size -= static_cast<size_t>(done);
    offset += static_cast<uint64_t>(done);
  }
  return done;
}

}  // namespace

void RecordBytes::copyTo(std::vector<char>& to) const {
  to.clear();
  for (const std::string_view piece : pieces) to.insert(to.end(), piece.begin(), piece.end());
}

RecordStore::RecordStore(const std::string& folder, uint64_t max_bytes, size_t max_waiting)
    : folder_(printable(folder)),
      max_waiting_(max_waiting),
      runs_(std::min<uint64_t>(max_bytes / kUnitBytes, UINT32_MAX)) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  file_ = openUnnamed(folder);
  if (file_ < 0) {
    throw std::runtime_error("cannot create a file in map/page_folder '" + folder_ +
                             "': " + textOf(errno) + "; set it to a writable folder");
  }
  helper_.start([] {});  // fails here if no thread can be started
}

RecordStore::~RecordStore() {
  clear();
  close(file_);
}

std::optional<StoredRecord> RecordStore::write(RecordBytes record) {
  const size_t bytes = record.size();
  Lock lock(mutex_);
  if (disk_refuses_) startWriting();
  const auto start = Clock::now();
  changed_.wait(lock, [&] {
    return disk_refuses_ || waiting_.empty() || waiting_bytes_ + bytes <= max_waiting_;
  });
  countWait(start, stats_);
  if (disk_refuses_) return std::nullopt;
  const auto first = runs_.take(unitsOf(bytes));
  if (!first) {
    note(kFull);
    return std::nullopt;
  }
  const StoredRecord stored{++last_number_, static_cast<uint32_t>(*first),
                            static_cast<uint32_t>(bytes)};
  waiting_.emplace(stored.number, std::pair(std::move(record), stored.offset()));
  waiting_bytes_ += bytes;
  startWriting();
  return stored;
}

/// @pre The mutex is locked.
void RecordStore::startWriting() {
  disk_refuses_ = false;
  if (!std::exchange(is_writing_, true)) helper_.start([this] { writeWaiting(); });
}

/// Tries to write each waiting record once. Those that the disk refuses are skipped, since it may
/// accept others; after kGroup in a row, the helper gives up.
void RecordStore::writeWaiting() {
  std::vector<char> buffer;
  std::string problem;
  int tried = 0, refused = 0;  // in total, and in a row
  Lock lock(mutex_);
  for (auto next = waiting_.begin(); next != waiting_.end() && refused < kGroup;) {
    const auto& [record, offset] = next->second;
    writing_ = next->first;
    lock.unlock();
    std::string refusal = writeOne(next->first, record, offset, buffer);
    lock.lock();
    writing_ = 0;
    tried_.notify_all();
    if (refusal.empty()) {
      waiting_bytes_ -= record.size();
      next = waiting_.erase(next);
      refused = 0;
    } else {
      problem = std::move(refusal);
      ++next;
      ++refused;
    }
    if (++tried % kGroup == 0) changed_.notify_all();
  }
  disk_refuses_ = !problem.empty();
  if (disk_refuses_) note(std::move(problem));
  is_writing_ = false;
  changed_.notify_all();
}

/// Writes a record, followed by its checksum. @return the error; empty on success.
std::string RecordStore::writeOne(uint64_t number, const RecordBytes& record, uint64_t offset,
                                  std::vector<char>& buffer) const try {
  record.copyTo(buffer);
  const uint64_t sum = XXH3_64bits_withSeed(buffer.data(), buffer.size(), number);
  const char* const sum_bytes = reinterpret_cast<const char*>(&sum);
  buffer.insert(buffer.end(), sum_bytes, sum_bytes + kSumBytes);
  const auto call = [this](const char* data, size_t size, off_t at) {
    return pwrite(file_, data, size, at);
  };
  const ssize_t done = transferAll(buffer.data(), buffer.size(), offset, call);
  if (done > 0) return "";
  return "cannot write to map/page_folder '" + folder_ + "': " + textOf(done < 0 ? errno : ENOSPC);
} catch (const std::bad_alloc&) {  // a helper that ended would be waited for forever
  return "out of memory";
}

RecordStore::Reading RecordStore::read(const StoredRecord& record, std::vector<char>& to) {
  {
    const Lock lock(mutex_);
    if (const auto found = waiting_.find(record.number); found != waiting_.end()) {
      found->second.first.copyTo(to);
      return Reading::kIntact;
    }
  }
  to.resize(record.bytes + kSumBytes);
  std::string problem = transfer(record, to);
  for (int tries = disk_responds_ ? kTries : 1, pause_ms = 1; !problem.empty() && tries > 1;
       --tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(std::exchange(pause_ms, 2 * pause_ms)));
    problem = transfer(record, to);
  }
  char first;
  disk_responds_ = problem.empty() || pread(file_, &first, 1, 0) >= 0;
  uint64_t sum;
  std::memcpy(&sum, to.data() + record.bytes, kSumBytes);
  to.resize(record.bytes);
  if (problem.empty() && XXH3_64bits_withSeed(to.data(), record.bytes, record.number) == sum) {
    return Reading::kIntact;
  }
  const Lock lock(mutex_);
  if (problem.empty()) {
    stats_.problem = "data read from map/page_folder is damaged; check the disk";
  } else {
    note(std::move(problem));
  }
  if (!disk_responds_) return Reading::kUnreadable;
  ++stats_.lost;
  return Reading::kDamaged;
}

/// Reads a record. If the file ends too early, the rest is filled with zeros: the record then
/// counts as damaged, and reading it is not retried.
/// @return the error; empty on success.
std::string RecordStore::transfer(const StoredRecord& record, std::vector<char>& to) const {
  std::fill(to.begin(), to.end(), 0);
  const auto call = [this](char* data, size_t size, off_t offset) {
    return pread(file_, data, size, offset);
  };
  if (transferAll(to.data(), to.size(), record.offset(), call) >= 0) return "";
  return "cannot read from map/page_folder '" + folder_ + "': " + textOf(errno);
}

void RecordStore::readAhead(const StoredRecord& record) const {
  posix_fadvise(file_, static_cast<off_t>(record.offset()), record.bytes, POSIX_FADV_WILLNEED);
}

void RecordStore::erase(const StoredRecord& record) noexcept {
  Lock lock(mutex_);
  tried_.wait(lock, [&] { return writing_ != record.number; });
  if (const auto found = waiting_.find(record.number); found != waiting_.end()) {
    waiting_bytes_ -= record.bytes;
    waiting_.erase(found);
    changed_.notify_all();
  }
  runs_.give(record.unit, unitsOf(record.bytes));
  emptyUnusedFile();
}

void RecordStore::clear() noexcept {
  Lock lock(mutex_);
  waiting_.erase(waiting_.upper_bound(writing_), waiting_.end());  // none are left to write
  changed_.wait(lock, [this] { return !is_writing_; });
  waiting_.clear();
  waiting_bytes_ = 0;
  disk_refuses_ = false;
  runs_.clear();
  emptyUnusedFile();
}

/// Empties the file if no record is left. If the system refuses, the file keeps its length.
void RecordStore::emptyUnusedFile() noexcept {
  if (runs_.inUse() > 0) return;
  [[maybe_unused]] const int refused = ftruncate(file_, 0);
}

size_t RecordStore::waitingBytes() const {
  const Lock lock(mutex_);
  return waiting_bytes_;
}

/// @pre The mutex is locked.
void RecordStore::note(std::string problem) {
  stats_.problem = std::move(problem);
  ++stats_.failures;
}

void RecordStore::noteWait(Clock::time_point start) {
  const Lock lock(mutex_);
  countWait(start, stats_);
}

void RecordStore::countLost() {
  const Lock lock(mutex_);
  ++stats_.lost;
}

void RecordStore::resetCounts() {
  const Lock lock(mutex_);
  stats_ = PageStats();
}

PageStats RecordStore::stats() const {
  const Lock lock(mutex_);
  PageStats stats = stats_;
  stats.bytes = runs_.inUse() * kUnitBytes;
  stats.index_bytes = runs_.bytes() + waiting_bytes_;
  return stats;
}
}  // namespace dtsdf
