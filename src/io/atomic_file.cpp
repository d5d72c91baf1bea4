#include "io/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

constexpr size_t kBufferBytes = 1 << 20;

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

/// Whether the file that is open still has this name.
bool isNamed(int descriptor, const std::string& name) {
  struct stat opened {
  }, named{};
  return fstat(descriptor, &opened) == 0 && stat(name.c_str(), &named) == 0 &&
         opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
}

/// Opens a file beside `path` that no other save has locked, with its name in `name`. If it exists,
/// a save that was killed has left it, and it is written again.
int openBeside(const std::string& path, std::string& name) {
  constexpr int kMostNames = 1000;
  int error_number = EACCES;
  for (int i = 0; i < kMostNames && error_number == EACCES; ++i) {
    const std::string target = fs::path(path).filename().string();
    name = (folderOf(path) / ("." + target + "." + std::to_string(i) + ".tmp")).string();
    const int descriptor =
        open(name.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
    if (descriptor < 0) {
      error_number = errno;  // EACCES: another user's
      continue;
    }
    // File systems without locks say so by another error.
    const bool is_free = flock(descriptor, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
    if (is_free && isNamed(descriptor, name)) {
      if (ftruncate(descriptor, 0) == 0) return descriptor;
      error_number = errno;
    }
    close(descriptor);
  }
  throwCannotWrite(path, error_number);
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
  buffer_.reserve(kBufferBytes);
  descriptor_ = openBeside(path_, temporary_path_);
}

AtomicFile::~AtomicFile() { closeAndRemove(); }

void AtomicFile::closeAndRemove() noexcept {
  if (descriptor_ < 0) return;
  unlink(temporary_path_.c_str());  // while it is locked: its name is not yet another save's
  close(descriptor_);
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
  if (rename(temporary_path_.c_str(), path_.c_str()) != 0) fail(errno);
  close(descriptor_);  // and with it the lock
  descriptor_ = -1;
  syncFolder(folderOf(path_));
}

void writeFileAtomically(const std::string& path, const std::string& content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

}  // namespace dtsdf
