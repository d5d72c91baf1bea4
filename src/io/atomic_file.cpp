#include "io/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "io/write_all.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

constexpr size_t kBufferBytes = 1 << 20;

[[noreturn]] void throwCannotWrite(const std::string& path, int error_number) {
  throw std::runtime_error("cannot write '" + path +
                           "': " + std::generic_category().message(error_number) +
                           "; choose another file name or folder, or free some space");
}

fs::path folderOf(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

/// An unused file name in the same folder as `path`.
std::string nameBeside(const std::string& path) {
  static std::atomic<unsigned> counter{0};
  std::string name;
  do {
    name = (folderOf(path) / ("." + fs::path(path).filename().string() + "." +
                              std::to_string(getpid()) + "." + std::to_string(counter++) + ".tmp"))
               .string();
  } while (access(name.c_str(), F_OK) == 0);
  return name;
}

/// Makes a rename in the folder durable. Errors are ignored: some file systems cannot sync folders,
/// and the file is complete either way.
void syncFolder(const fs::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  fsync(descriptor);
  close(descriptor);
}

}  // namespace

void prepareOutputFile(const std::string& path) {
  if (path.empty() || fs::path(path).filename().empty() || path.find('\0') != path.npos) {
    throw std::runtime_error("cannot write '" + std::string(path.c_str()) + "': give a file name");
  }
  std::error_code error;
  fs::create_directories(folderOf(path), error);
  if (error) throwCannotWrite(path, error.value());
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw std::runtime_error("cannot write '" + path +
                             "': it exists and is not a regular file; choose another name");
  }
  if (access(folderOf(path).c_str(), W_OK | X_OK) != 0) throwCannotWrite(path, errno);
}

AtomicFile::AtomicFile(const std::string& path) : path_(path), temporary_path_(nameBeside(path)) {
  prepareOutputFile(path_);
  buffer_.reserve(kBufferBytes);
  descriptor_ = open(temporary_path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throwCannotWrite(path_, errno);
}

AtomicFile::~AtomicFile() { closeAndRemove(); }

void AtomicFile::closeAndRemove() noexcept {
  if (descriptor_ < 0) return;
  close(descriptor_);
  descriptor_ = -1;
  unlink(temporary_path_.c_str());
}

void AtomicFile::fail(int error_number) {
  closeAndRemove();
  throwCannotWrite(path_, error_number);
}

void AtomicFile::write(const void* data, size_t bytes) {
  buffer_.append(static_cast<const char*>(data), bytes);
  if (buffer_.size() >= kBufferBytes) flush();
}

void AtomicFile::flush() {
  if (const int error = writeAll(descriptor_, buffer_.data(), buffer_.size(), ::write)) fail(error);
  buffer_.clear();
}

void AtomicFile::commit() {
  flush();
  if (fsync(descriptor_) != 0) fail(errno);
  const bool is_closed = close(std::exchange(descriptor_, -1)) == 0;
  const int error_number =
      is_closed && rename(temporary_path_.c_str(), path_.c_str()) == 0 ? 0 : errno;
  if (error_number != 0) {
    unlink(temporary_path_.c_str());
    throwCannotWrite(path_, error_number);
  }
  syncFolder(folderOf(path_));
}

void writeFileAtomically(const std::string& path, const std::string& content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

}  // namespace dtsdf
