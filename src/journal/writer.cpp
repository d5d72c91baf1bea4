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
  std::string path;
  int file = -1, number = 1;
  do {
    path = name + (number == 1 ? "" : "_" + std::to_string(number)) + journal::kExtension;
    file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666);
  } while (file < 0 && errno == EEXIST && ++number < 1000);
  const int error = file < 0 ? errno : writeAll(file, head.data(), head.size(), options_.write);
  if (error != 0) {
    if (file >= 0) unlink(path.c_str());
    if (file >= 0) close(file);
    throw std::runtime_error("cannot write a journal to '" + printable(options_.folder) +
                             "': " + reasonOf(error) + "; set journal/folder to a writable folder");
  }
  if (descriptor_ >= 0) close(descriptor_);
  descriptor_ = file;
  whole_bytes_ = head.size();
  records_ = 0;
  other_journals_bytes_ = bytesOfJournalsIn(options_.folder, path);
  const std::lock_guard<std::mutex> lock(mutex_);
  path_ = path;
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
    for (Entry& entry : entries_) {
      if (is_stopped_) entry.write = nullptr;  // belongs to the map before
    }
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
  if (std::exchange(has_begun_, true)) openFile();
  journal::Begin with_map = begin;
  with_map.has_map = map != nullptr;
  append(journal::encode(with_map));
  if (map == nullptr) return;
  RecordWriter out([this](const Bytes& record) { append(record); });
  writeMap(
      map->head(), [map](size_t chunk) { return map->part(chunk); }, out, 1);
}

void JournalWriter::add(journal::Call call) {
  Entry entry;
  if (const auto* const image = std::get_if<journal::Image>(&call)) {
    entry.bytes = std::visit(
        [](const auto& frame) { return frame.row_bytes * static_cast<size_t>(frame.height); },
        image->frame);
  }
  entry.write = [this, call = std::move(call)] { append(journal::encode(call)); };
  push(std::move(entry));
}

std::string JournalWriter::path() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return path_;
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
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return is_ending_ || !entries_.empty(); });
    if (entries_.empty()) return;
    Entry entry = std::move(entries_.front());
    entries_.pop_front();
    if (entry.written) {
      entry.written->set_value(!is_stopped_);
      continue;
    }
    const bool is_lost = is_stopped_ || !entry.write;  // entries after a failure are lost, too
    lock.unlock();
    if (!is_lost) write(entry);
    const size_t bytes = entry.bytes;
    entry = Entry();  // frees the image before its bytes are subtracted
    lock.lock();
    waiting_bytes_ -= bytes;
  }
}

void JournalWriter::write(const Entry& entry) {
  std::string problem;
  try {
    entry.write();
    if (const auto now = std::chrono::steady_clock::now(); now >= synced_ + kSyncEvery) {
      synced_ = now;
      if (options_.sync(descriptor_) != 0) throwCannotWrite(errno);
    }
  } catch (const std::exception& error) {
    problem = errorText(error);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.bytes = whole_bytes_;
  if (!problem.empty()) stop(problem);
}

/// @param records One record, or the two of an image.
void JournalWriter::append(const Bytes& records) {
  records_ += 2;
  if (records_ > kMaxRecords) {
    throw std::runtime_error("the journal has reached its maximum number of records");
  }
  if (other_journals_bytes_ + whole_bytes_ + records.size() > options_.max_bytes) {
    throw std::runtime_error(
        "the journals in '" + printable(options_.folder) +
        "' have reached the limit journal/max_gb; raise it, or remove old journals");
  }
  if (const int error = writeAll(descriptor_, records.data(), records.size(), options_.write)) {
    throwCannotWrite(error);
  }
  whole_bytes_ += records.size();
}

void JournalWriter::throwCannotWrite(int error_number) const {
  throw std::runtime_error("cannot write '" + printable(path_) + "': " + reasonOf(error_number));
}

/// @pre mutex_ is held.
void JournalWriter::stop(const std::string& why) {
  is_stopped_ = true;
  report_.problem = why + "; nothing has been written since " + timeText("%Y-%m-%d %H:%M:%S UTC") +
                    "; call clear_map to begin a new journal";
}

JournalReport JournalWriter::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  JournalReport report = report_;
  report.waiting_bytes = waiting_bytes_;
  return report;
}

}  // namespace dtsdf
