#include "journal/writer.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <variant>

#include "io/write_all.h"
#include "params/printable.h"
#include "params/text.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

std::string reasonOf(int error_number) { return std::generic_category().message(error_number); }

/// The current time in UTC, for file names and messages.
std::string timeText(const char* format) {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[64];
  return {text, std::strftime(text, sizeof(text), format, &parts)};
}

/// Total size of the journals in a folder. Ignores the writer's `own` journal, symbolic links, and
/// other files with the same extension.
uint64_t bytesOfJournalsIn(const std::string& folder, const std::string& own) {
  uint64_t bytes = 0;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == journal::kExtension && entry.path() != own &&
        !entry.is_symlink(error) && RecordFile::hasPurpose(entry.path(), journal::kPurpose)) {
      bytes += entry.file_size(error);
    }
  }
  return bytes;
}

constexpr std::chrono::seconds kSyncEvery(1);
constexpr size_t kMaxRecordsOfCall = 2;

/// Bytes reserved so that the headers of up to 64 files can be written even at the limit.
constexpr uint64_t kHeadReserve = 64 * kFileHeadBytes;

}  // namespace

JournalWriter::JournalWriter(Options options) : options_(std::move(options)) {
  openFile();
  thread_ = std::thread([this] { loop(); });
}

void JournalWriter::openFile() {
  std::error_code ignored;
  fs::create_directories(options_.folder, ignored);
  const std::string name = options_.folder + "/" + timeText("%Y%m%d-%H%M%S");
  const Bytes head = fileHead(journal::kPurpose);
  int number = 1;
  do {
    path_ = name + (number == 1 ? "" : "-" + std::to_string(number)) + journal::kExtension;
    descriptor_ = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666);
  } while (descriptor_ < 0 && errno == EEXIST && ++number < 1000);
  const int error =
      descriptor_ < 0 ? errno : writeAll(descriptor_, head.data(), head.size(), options_.write);
  whole_bytes_ = report_.bytes = head.size();
  if (error == 0) return;
  if (descriptor_ >= 0) unlink(path_.c_str());
  if (descriptor_ >= 0) close(descriptor_);
  throw std::runtime_error("cannot write a journal to '" + printable(options_.folder) +
                           "': " + reasonOf(error) + "; set journal/folder to a writable folder");
}

JournalWriter::~JournalWriter() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
  close(descriptor_);
}

void JournalWriter::begin(const journal::Begin& begin, std::shared_ptr<const MapChunks> map) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!can_resume_) return;
    is_stopped_ = false;
    count_ = 0;
    report_.problem.clear();
  }
  Entry entry;
  entry.begins = true;
  entry.write = [this, begin, map = std::move(map)] { writeBegin(begin, map.get()); };
  push(std::move(entry));
}

/// Writes the beginning of a map, and the records of `map` unless it is null.
void JournalWriter::writeBegin(const journal::Begin& begin, const MapChunks* map) {
  other_journals_bytes_ = bytesOfJournalsIn(options_.folder, path_);
  journal::Begin with_map = begin;
  with_map.has_map = map != nullptr;
  const Bytes head = journal::encode(with_map);
  append(head.data(), head.size(), 1);
  if (map == nullptr) return;
  RecordWriter out([this](const void* data, size_t bytes) { append(data, bytes, 1); });
  writeMap(
      map->head(), [map](size_t chunk) { return map->part(chunk); }, out, 1);
}

void JournalWriter::add(journal::Call call) {
  Entry entry;
  size_t records = 1;
  if (const auto* const image = std::get_if<journal::Image>(&call)) {
    records = kMaxRecordsOfCall;
    entry.bytes = std::visit(
        [](const auto& frame) { return frame.row_bytes * static_cast<size_t>(frame.height); },
        image->frame);
  }
  entry.write = [this, call = std::move(call), records] {
    const Bytes encoded = journal::encode(call);
    append(encoded.data(), encoded.size(), records);
  };
  push(std::move(entry));
}

uint64_t JournalWriter::count() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return count_;
}

std::future<bool> JournalWriter::written() {
  Entry entry;
  entry.written.emplace();
  std::future<bool> written = entry.written->get_future();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    entries_.push_back(std::move(entry));
  }
  changed_.notify_all();
  return written;
}

void JournalWriter::push(Entry entry) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!is_stopped_ && waiting_bytes_ + entry.bytes > options_.max_waiting) {
      stop("the disk is too slow");
    }
    if (is_stopped_) return;
    if (!entry.begins) ++count_;
    waiting_bytes_ += entry.bytes;
    entries_.push_back(std::move(entry));
  }
  changed_.notify_all();
}

void JournalWriter::loop() {
  auto synced = std::chrono::steady_clock::now();
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return is_ending_ || !entries_.empty(); });
    if (entries_.empty()) return;
    Entry entry = std::move(entries_.front());
    entries_.pop_front();
    const bool is_lost = is_stopped_;  // entries after a failure are lost, too
    if (entry.written) {
      entry.written->set_value(!is_stopped_);
      continue;
    }
    lock.unlock();
    if (!is_lost) write(entry);
    int sync_error = 0;
    if (std::chrono::steady_clock::now() >= synced + kSyncEvery) {
      if (options_.sync(descriptor_) != 0) sync_error = errno;
      synced = std::chrono::steady_clock::now();
    }
    const size_t bytes = entry.bytes;
    entry = Entry();  // frees the image before its bytes are subtracted
    lock.lock();
    waiting_bytes_ -= bytes;
    if (sync_error == 0) continue;
    can_resume_ = false;  // records written earlier may be missing
    stop("cannot write '" + printable(path_) + "': " + reasonOf(sync_error) +
         "; earlier images may be missing, too");
  }
}

void JournalWriter::write(const Entry& entry) {
  const uint64_t begin = whole_bytes_;
  std::string problem;
  try {
    entry.write();
    const std::lock_guard<std::mutex> lock(mutex_);
    report_.bytes = whole_bytes_;
    return;
  } catch (const std::exception& error) {
    problem = errorText(error);
  }
  // Cuts off the incomplete record.
  whole_bytes_ = begin;
  const auto end = static_cast<off_t>(begin);
  const bool is_whole =
      ftruncate(descriptor_, end) == 0 && lseek(descriptor_, end, SEEK_SET) == end;
  const std::lock_guard<std::mutex> lock(mutex_);
  can_resume_ = is_whole && records_ + kMaxRecordsOfCall <= kMaxRecords;
  report_.bytes = begin;
  stop(problem);
}

void JournalWriter::append(const void* data, size_t bytes, size_t records) {
  if (records_ + records > kMaxRecords) {
    throw std::runtime_error("the journal has reached its maximum number of records");
  }
  if (other_journals_bytes_ + whole_bytes_ + bytes + kHeadReserve > options_.max_bytes) {
    throw std::runtime_error(
        "the journals in '" + printable(options_.folder) +
        "' have reached the limit journal/max_gb; raise it, or remove old journals");
  }
  if (const int error = writeAll(descriptor_, data, bytes, options_.write)) {
    throw std::runtime_error("cannot write '" + printable(path_) + "': " + reasonOf(error));
  }
  whole_bytes_ += bytes;
  records_ += records;
}

/// @pre mutex_ is held.
void JournalWriter::stop(const std::string& why) {
  is_stopped_ = true;
  report_.problem = why + "; nothing has been written since " + timeText("%Y-%m-%d %H:%M:%S UTC") +
                    "; " + (can_resume_ ? "call clear_map" : "restart the node") +
                    " to begin a new journal";
}

JournalReport JournalWriter::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  JournalReport report = report_;
  report.waiting_bytes = waiting_bytes_;
  return report;
}

}  // namespace dtsdf
