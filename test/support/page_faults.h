/// Simulates disk faults: reads and writes that fail, damaged page files, and a full disk.
#pragma once

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace dtsdf {

inline std::vector<int> openFilesIn(const std::string& folder) {
  std::vector<int> files;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code error;
    const std::string target = std::filesystem::read_symlink(entry.path(), error).string();
    if (error || target.rfind(folder, 0) != 0) continue;
    files.push_back(std::stoi(entry.path().filename().string()));
  }
  return files;
}

/// Overwrites three bytes at each of the first `pieces` multiples of `bytes` in all page files.
inline void damagePages(const std::string& folder, int pieces, off_t bytes) {
  for (const int file : openFilesIn(folder)) {
    for (int i = 0; i < pieces; ++i) {
      if (pwrite(file, "xyz", 3, i * bytes) < 0) return;
    }
  }
}

/// Overwrites the whole contents of all page files.
inline void overwritePages(const std::string& folder) {
  const std::string other(4096, 'x');
  for (const int file : openFilesIn(folder)) {
    const off_t end = lseek(file, 0, SEEK_END);
    for (off_t at = 0; at < end; at += static_cast<off_t>(other.size())) {
      if (pwrite(file, other.data(), other.size(), at) < 0) return;
    }
  }
}

/// While an object of this class exists, all reads and writes of page files fail.
class DiskOutage {
 public:
  explicit DiskOutage(const std::string& folder) {
    const std::vector<int> files = openFilesIn(folder);
    const int none = open("/", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    for (const int file : files) {
      saved_.emplace_back(file, dup(file));
      dup2(none, file);
    }
    close(none);
  }
  ~DiskOutage() {
    for (const auto& [file, saved] : saved_) {
      dup2(saved, file);
      close(saved);
    }
  }
  DiskOutage(const DiskOutage&) = delete;
  DiskOutage& operator=(const DiskOutage&) = delete;

 private:
  std::vector<std::pair<int, int>> saved_;
};

/// While an object of this class exists, this process cannot write files larger than a limit.
/// Writes beyond the limit fail with EFBIG, similar to ENOSPC on a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limited{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limited);
  }
  ~FileSizeLimit() { setrlimit(RLIMIT_FSIZE, &before_); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
};

}  // namespace dtsdf
