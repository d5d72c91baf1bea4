#include "log/log_folder.h"

#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "params/text.h"

namespace dtsdf {
namespace {

/// By opendir: the iterators of std::filesystem end the process where they find no memory.
std::vector<std::string> entriesOf(const std::string& folder) {
  std::vector<std::string> names;
  const std::unique_ptr<DIR, int (*)(DIR*)> opened(opendir(folder.c_str()), closedir);
  if (opened == nullptr) return names;
  while (const dirent* const entry = readdir(opened.get())) names.emplace_back(entry->d_name);
  std::sort(names.begin(), names.end());
  return names;
}

/// Of a name of so many digits or more, and an ending.
bool isNumbered(const std::string& name, size_t digits, const std::string& ending) {
  if (name.size() < digits + ending.size()) return false;
  const std::string number = name.substr(0, name.size() - ending.size());
  return number.find_first_not_of("0123456789") == std::string::npos && number.size() < 18 &&
         name.substr(number.size()) == ending;
}

std::string numbered(uint64_t index, int digits) {
  return formatted("%0*llu", digits, static_cast<unsigned long long>(index));
}

constexpr int kStretchDigits = 6, kSegmentDigits = 6;
constexpr char kWaitingMapEnding[] = ".waiting.dtsdf";

bool isFolder(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
}

}  // namespace

std::vector<LogStretchFolder> stretchesIn(const std::string& folder) {
  std::vector<LogStretchFolder> stretches;
  for (const std::string& name : entriesOf(folder)) {
    const std::string path = folder + "/" + name;
    if (isNumbered(name, kStretchDigits, "") && isFolder(path)) {
      stretches.push_back({path, std::stoull(name)});
    }
  }
  std::sort(stretches.begin(), stretches.end(),
            [](const auto& a, const auto& b) { return a.index < b.index; });
  return stretches;
}

std::vector<std::string> segmentsIn(const std::string& stretch) {
  std::vector<std::string> segments;
  for (const std::string& name : entriesOf(stretch)) {
    if (isNumbered(name, kSegmentDigits, kLogSegmentExtension)) {
      segments.push_back(stretch + "/" + name);
    }
  }
  return segments;
}

std::string baseMapOf(const std::string& stretch) { return stretch + "/base.dtsdf"; }

std::string stretchName(const std::string& folder, uint64_t index) {
  return folder + "/" + numbered(index, kStretchDigits);
}

std::string segmentName(const std::string& stretch, uint64_t index) {
  return stretch + "/" + numbered(index, kSegmentDigits) + kLogSegmentExtension;
}

std::string waitingMapName(const std::string& folder, uint64_t index) {
  return folder + "/" + numbered(index, kStretchDigits) + kWaitingMapEnding;
}

std::vector<std::string> waitingMapsIn(const std::string& folder) {
  std::vector<std::string> paths;
  for (const std::string& name : entriesOf(folder)) {
    if (isNumbered(name, kStretchDigits, kWaitingMapEnding)) paths.push_back(folder + "/" + name);
  }
  return paths;
}

bool isFrameLog(const std::string& folder) {
  for (const LogStretchFolder& stretch : stretchesIn(folder)) {
    if (!segmentsIn(stretch.path).empty()) return true;
  }
  return false;
}

uint64_t bytesIn(const std::string& stretch) {
  uint64_t bytes = 0;
  for (const std::string& name : entriesOf(stretch)) {
    struct stat status {};
    if (stat((stretch + "/" + name).c_str(), &status) == 0 && S_ISREG(status.st_mode)) {
      bytes += static_cast<uint64_t>(status.st_size);
    }
  }
  return bytes;
}

/// The newest segments first, so that what is left by a failure is a log with its beginning.
void removeStretch(const std::string& stretch) noexcept {
  try {
    std::vector<std::string> names = entriesOf(stretch);
    std::reverse(names.begin(), names.end());
    for (const std::string& name : names) unlink((stretch + "/" + name).c_str());
    rmdir(stretch.c_str());
  } catch (...) {  // without memory: the next one tries again
  }
}

}  // namespace dtsdf
