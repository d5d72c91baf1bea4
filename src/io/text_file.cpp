#include "io/text_file.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

/// Larger than any list of images or poses, and than any image.
constexpr uintmax_t kMaxBytes = uintmax_t{1} << 30;

/// Why the file cannot be read whole; empty if nothing speaks against it. Devices and pipes may
/// have no end, or never begin.
std::string whyUnreadable(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (error == std::errc::too_many_symbolic_link_levels) return "it is a link to itself";
  if (!fs::exists(status)) return "no such file";
  if (fs::is_directory(status)) return "it is a folder";
  if (!fs::is_regular_file(status)) return "it is a device or a pipe, not a file";
  const uintmax_t bytes = fs::file_size(path, error);
  if (!error && bytes > kMaxBytes) return "it is larger than 1 GiB";
  return "";
}

/// False if it cannot be opened, or a read fails on the way.
bool readWhole(const std::string& path, std::string& text) {
  std::ifstream file(path, std::ios::binary);
  std::vector<char> part(1 << 16);
  while (file) {
    file.read(part.data(), static_cast<std::streamsize>(part.size()));
    text.append(part.data(), static_cast<size_t>(file.gcount()));
  }
  return file.eof() && !file.bad();
}

}  // namespace

void requireRegularFile(const std::string& path, const std::string& advice) {
  const std::string problem = whyUnreadable(path);
  if (problem.empty()) return;
  throw std::runtime_error("cannot read '" + path + "': " + problem + "; " + advice);
}

std::string readTextFile(const std::string& path, const std::string& advice) {
  requireRegularFile(path, advice);
  std::string text;
  if (readWhole(path, text)) return text;
  throw std::runtime_error("cannot read '" + path + "': read error; " + advice);
}

}  // namespace dtsdf
