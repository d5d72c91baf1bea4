#include "io/atomic_file.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <system_error>

#include "params/text.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

constexpr size_t kBufferBytes = 1 << 20;
const char* const kEnding = ".tmp";
/// Whoever has made a file beside its target has locked it by then.
constexpr int64_t kAbandonedAfter_s = 60;

std::string adviceFor(int error_number) {
  switch (error_number) {
    case ENOSPC:
    case EDQUOT:
    case EFBIG: return "; free some space or choose another folder";
    case EACCES:
    case EPERM:
    case EROFS: return "; choose a folder that you may write to";
    case ENOTDIR:
    case EEXIST: return "; a part of its path is a file, choose another folder";
    default: return "; choose another file name or folder";
  }
}

[[noreturn]] void throwCannotWrite(const std::string& path, int error_number) {
  throw std::runtime_error("cannot write '" + path + "': " +
                           std::generic_category().message(error_number) + adviceFor(error_number));
}

fs::path folderOf(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

/// Begins the names of the files beside `path`.
std::string temporaryNameOf(const std::string& path) {
  return "." + fs::path(path).filename().string() + ".";
}

/// Unique in this process and, by the process id, among others that write to the same folder.
std::string temporaryPathFor(const std::string& path) {
  static std::atomic<unsigned> counter{0};
  const std::string name =
      temporaryNameOf(path) + std::to_string(getpid()) + "." + std::to_string(counter++) + kEnding;
  return (folderOf(path) / name).string();
}

bool isNumber(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

/// Whether a file of this name was made beside `path`: ".NAME.PID.COUNT.tmp".
bool isBeside(const std::string& name, const std::string& path) {
  const std::string begin = temporaryNameOf(path), end = kEnding;
  if (name.size() <= begin.size() + end.size() || name.compare(0, begin.size(), begin) != 0 ||
      !endsWith(name, end)) {
    return false;
  }
  const std::string rest = name.substr(begin.size(), name.size() - begin.size() - end.size());
  const size_t dot = rest.find('.');
  return dot != std::string::npos && isNumber(rest.substr(0, dot)) &&
         isNumber(rest.substr(dot + 1));
}

/// Removes a file beside its target whose writer is gone: writers hold a lock, which ends with
/// them, on whatever machine they run. Does nothing where that cannot be known.
void removeIfAbandoned(const std::string& path) {
  const int descriptor = open(path.c_str(), O_WRONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return;
  struct stat status {};
  if (fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) &&
      time(nullptr) - status.st_mtime > kAbandonedAfter_s &&
      flock(descriptor, LOCK_EX | LOCK_NB) == 0) {
    unlink(path.c_str());
  }
  close(descriptor);
}

/// What saves that were killed have left beside `path`. Not by std::filesystem, whose iterators end
/// the process where they find no memory.
void removeAbandoned(const std::string& path) {
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(opendir(folderOf(path).c_str()), closedir);
  if (folder == nullptr) return;
  while (const dirent* const entry = readdir(folder.get())) {
    const std::string name = entry->d_name;
    if (isBeside(name, path)) removeIfAbandoned((folderOf(path) / name).string());
  }
}

/// The rename is on the disk only once its folder is. Some file systems cannot sync a folder; the
/// file itself is whole either way, so that is no failure.
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

AtomicFile::AtomicFile(const std::string& path) : path_(path) {
  prepareOutputFile(path_);
  removeAbandoned(path_);
  buffer_.reserve(kBufferBytes);
  temporary_path_ = temporaryPathFor(path_);
  descriptor_ = open(temporary_path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throwCannotWrite(path_, errno);
  // Shows that it is not abandoned. Nothing may throw from here on: nobody would remove the file.
  flock(descriptor_, LOCK_EX | LOCK_NB);
}

AtomicFile::~AtomicFile() { closeAndRemove(); }

void AtomicFile::closeAndRemove() noexcept {
  if (descriptor_ < 0) return;
  close(descriptor_);
  unlink(temporary_path_.c_str());
  descriptor_ = -1;
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
  const char* next = buffer_.data();
  size_t left = buffer_.size();
  while (left > 0) {
    const ssize_t written = ::write(descriptor_, next, left);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(written < 0 ? errno : ENOSPC);
    next += written;
    left -= static_cast<size_t>(written);
  }
  buffer_.clear();
}

void AtomicFile::commit() {
  flush();
  if (fsync(descriptor_) != 0) fail(errno);
  const int descriptor = descriptor_;
  descriptor_ = -1;
  if (close(descriptor) != 0 || rename(temporary_path_.c_str(), path_.c_str()) != 0) {
    const int error_number = errno;
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
