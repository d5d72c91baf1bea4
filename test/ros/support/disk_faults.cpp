// Simulates a failing disk when preloaded into a program. While the file FOLDER.fault contains
// "full", "read_only" or "gone", system calls that change files in FOLDER fail accordingly.
// DTSDF_DISK_FOLDER sets FOLDER. Changing permissions would not affect root, and filling the real
// disk would disturb other programs.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

constexpr off_t kBytesLeftOnFullDisk = 1000;  ///< Each file can still grow to this size.

const char* faultyFolder() { return std::getenv("DTSDF_DISK_FOLDER"); }

bool liesInFolder(const char* path) {
  const char* const folder = faultyFolder();
  return folder != nullptr && std::strncmp(path, folder, std::strlen(folder)) == 0 &&
         (path[std::strlen(folder)] == '/' || path[std::strlen(folder)] == '\0');
}

bool liesInFolder(int file) {
  char link[64], path[4096];
  std::snprintf(link, sizeof(link), "/proc/self/fd/%d", file);
  const ssize_t size = readlink(link, path, sizeof(path) - 1);
  if (size <= 0) return false;
  path[size] = '\0';
  return liesInFolder(path);
}

/// Whether faults of this kind are being simulated. Uses system calls directly, because the
/// functions below would recurse.
bool isFault(const char* kind) {
  const int error = errno;
  char path[4096], content[32] = "";
  std::snprintf(path, sizeof(path), "%s.fault", faultyFolder());
  const long file = syscall(SYS_openat, AT_FDCWD, path, O_RDONLY | O_CLOEXEC);
  if (file >= 0) {
    syscall(SYS_read, file, content, sizeof(content) - 1);
    syscall(SYS_close, file);
  }
  errno = error;
  return std::strcmp(content, kind) == 0;
}

int fail(int error) {
  errno = error;
  return -1;
}

int openFile(const char* path, int flags, int mode) {
  const bool writes = (flags & (O_WRONLY | O_RDWR | O_CREAT)) != 0;
  if (writes && liesInFolder(path) && isFault("read_only")) return fail(EROFS);
  return static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, flags, mode));
}

}  // namespace

extern "C" {

ssize_t write(int file, const void* data, size_t bytes) {
  if (liesInFolder(file) && isFault("full")) {
    const off_t left = kBytesLeftOnFullDisk - lseek(file, 0, SEEK_CUR);
    if (left <= 0) return fail(ENOSPC);
    bytes = std::min(bytes, static_cast<size_t>(left));
  }
  return syscall(SYS_write, file, data, bytes);
}

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const int mode = va_arg(arguments, int);
  va_end(arguments);
  return openFile(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const int mode = va_arg(arguments, int);
  va_end(arguments);
  return openFile(path, flags, mode);
}

int mkdir(const char* path, mode_t mode) {
  if (liesInFolder(path) && isFault("read_only")) return fail(EROFS);
  return static_cast<int>(syscall(SYS_mkdirat, AT_FDCWD, path, mode));
}

int access(const char* path, int mode) {
  if ((mode & W_OK) != 0 && liesInFolder(path) && isFault("read_only")) return fail(EROFS);
  return static_cast<int>(syscall(SYS_faccessat, AT_FDCWD, path, mode));
}

int rename(const char* from, const char* to) {
  if (liesInFolder(to) && isFault("read_only")) return fail(EROFS);
  if (liesInFolder(to) && isFault("gone")) return fail(ENOENT);
  return static_cast<int>(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}

}  // extern "C"
