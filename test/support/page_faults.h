/// What a disk does to the page files in a folder: it reads nothing for a while, or gives back
/// other bytes than were written.
#pragma once

#include <fcntl.h>
#include <unistd.h>

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

/// All that was written there.
inline void overwritePages(const std::string& folder) {
  const std::string other(4096, 'x');
  for (const int file : openFilesIn(folder)) {
    const off_t end = lseek(file, 0, SEEK_END);
    for (off_t at = 0; at < end; at += static_cast<off_t>(other.size())) {
      if (pwrite(file, other.data(), other.size(), at) < 0) return;
    }
  }
}

/// As long as it is there, neither reads nor writes succeed.
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

}  // namespace dtsdf
