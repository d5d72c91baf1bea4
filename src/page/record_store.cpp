#include "page/record_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "params/printable.h"

namespace dtsdf {
namespace {

/// Of the file. Records are filled up to it.
constexpr uint64_t kUnitBytes = 256;

/// The end of the file is given back to the disk in steps.
constexpr uint64_t kShrinkBytes = uint64_t{1} << 20;

/// Of a read that fails, with pauses of 1, 2, 4 and 8 ms: one that fails for a moment loses
/// nothing.
constexpr int kTries = 5;

constexpr double kLeastWait_ms = 1.0;

uint64_t unitsOf(size_t bytes) { return bytes == 0 ? 1 : (bytes + kUnitBytes - 1) / kUnitBytes; }

std::string textOf(int error) { return std::generic_category().message(error); }

/// A file that has no name from the start, or, where the file system has no such, loses it at once.
int openUnnamed(const std::string& folder) {
  const int file = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL)) return file;
  std::string path = folder + "/dtsdf_pages_XXXXXX";
  const int named = mkostemp(path.data(), O_CLOEXEC);
  if (named >= 0) unlink(path.c_str());
  return named;
}

/// Calls call(address, bytes, offset) until all is done. @return what the last call did.
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

RecordStore::RecordStore(const std::string& folder, uint64_t max_bytes)
    : folder_(printable(folder)), max_bytes_(max_bytes), runs_(max_bytes / kUnitBytes) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  file_ = openUnnamed(folder);
  if (file_ < 0) {
    throw std::runtime_error("no file can be made in map/page_folder '" + folder_ +
                             "': " + textOf(errno) + "; set it to a folder that can be written");
  }
}

RecordStore::~RecordStore() { close(file_); }

std::optional<StoredRecord> RecordStore::write(const char* from, size_t bytes) {
  const auto first = runs_.take(unitsOf(bytes));
  if (!first) {
    countFull();
    return std::nullopt;
  }
  StoredRecord record{*first * kUnitBytes, 0, static_cast<uint32_t>(bytes)};
  const auto call = [this](const char* data, size_t size, off_t offset) {
    return pwrite(file_, data, size, offset);
  };
  if (const ssize_t done = transferAll(from, bytes, record.offset, call); done <= 0) {
    fail("cannot write to map/page_folder '" + folder_ + "': " + textOf(done < 0 ? errno : ENOSPC));
    erase(record);
    return std::nullopt;
  }
  if (runs_.end() * kUnitBytes > file_end_) file_end_ = runs_.end() * kUnitBytes;
  record.checksum = XXH3_64bits(from, bytes);
  return record;
}

RecordStore::Reading RecordStore::read(const StoredRecord& record, char* to) {
  for (int tries = may_pause_ ? kTries : 1, pause_ms = 1;; --tries, pause_ms *= 2) {
    bool is_short = false;
    const std::string problem = transfer(record, to, is_short);
    if (problem.empty() && XXH3_64bits(to, record.bytes) == record.checksum) {
      may_pause_ = true;
      return Reading::kIntact;
    }
    if (problem.empty() || is_short) {
      stats_.problem = "what was read from map/page_folder is damaged; check the disk";
      ++stats_.lost;
      return Reading::kDamaged;
    }
    if (tries == 1) {
      may_pause_ = false;
      fail(problem);
      return Reading::kUnreadable;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(pause_ms));
  }
}

/// @param is_short Set where the file has not so much: it will not come with another try.
/// @return what went wrong; empty: all was read.
std::string RecordStore::transfer(const StoredRecord& record, char* to, bool& is_short) const {
  const auto call = [this](char* data, size_t size, off_t offset) {
    return pread(file_, data, size, offset);
  };
  const ssize_t done = transferAll(to, record.bytes, record.offset, call);
  if (done > 0) return "";
  is_short = done == 0;
  return "cannot read from map/page_folder '" + folder_ +
         "': " + (done < 0 ? textOf(errno) : std::string("the file has become shorter"));
}

void RecordStore::readAhead(const StoredRecord& record) const {
  posix_fadvise(file_, static_cast<off_t>(record.offset), record.bytes, POSIX_FADV_WILLNEED);
}

void RecordStore::erase(const StoredRecord& record) noexcept {
  runs_.give(record.offset / kUnitBytes, unitsOf(record.bytes));
  shrink();
}

void RecordStore::clear() noexcept {
  runs_.clear();
  shrink();
}

/// It stays as long as it was where the system does not do it.
void RecordStore::shrink() noexcept {
  const uint64_t end = runs_.end() * kUnitBytes;
  if (end + (end > 0 ? kShrinkBytes : 0) >= file_end_) return;
  if (ftruncate(file_, static_cast<off_t>(end)) == 0) file_end_ = end;
}

uint64_t RecordStore::room() const {
  const uint64_t in_use = runs_.inUse() * kUnitBytes;
  return max_bytes_ > in_use ? max_bytes_ - in_use : 0;
}

void RecordStore::fail(const std::string& problem) {
  stats_.problem = problem;
  ++stats_.failures;
}

void RecordStore::countFull() { fail("map/page_folder has reached map/page_max_gb; raise it"); }

PagedStats RecordStore::stats() const {
  PagedStats stats = stats_;
  stats.bytes = runs_.inUse() * kUnitBytes;
  stats.index_bytes = runs_.bytes();
  return stats;
}

DiskWait::~DiskWait() {
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  if (ms < kLeastWait_ms) return;
  ++store_.stats_.waits;
  store_.stats_.wait_ms += ms;
}

}  // namespace dtsdf
