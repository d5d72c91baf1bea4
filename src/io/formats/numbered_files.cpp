#include "io/formats/numbered_files.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "params/text.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

/// The number in a name; nothing if the name is of another form.
std::optional<double> numberIn(const std::string& name, const std::string& prefix,
                               const std::string& suffix) {
  const size_t around = prefix.size() + suffix.size();
  if (name.size() <= around || name.compare(0, prefix.size(), prefix) != 0 ||
      !endsWith(name, suffix)) {
    return std::nullopt;
  }
  const std::string digits = name.substr(prefix.size(), name.size() - around);
  long long number = 0;
  if (!std::all_of(digits.begin(), digits.end(), [](unsigned char c) { return std::isdigit(c); }) ||
      !parseNumber(digits, number)) {
    return std::nullopt;
  }
  return static_cast<double>(number);
}

}  // namespace

std::vector<StampedImage> listNumberedFiles(const fs::path& folder, const std::string& prefix,
                                            const std::string& suffix) {
  std::vector<StampedImage> files;
  if (!fs::is_directory(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const auto number = numberIn(entry.path().filename().string(), prefix, suffix);
    if (number) files.push_back({*number, entry.path().string()});
  }
  std::sort(files.begin(), files.end(), [](const StampedImage& a, const StampedImage& b) {
    return std::tie(a.stamp_s, a.path) < std::tie(b.stamp_s, b.path);
  });
  return files;
}

std::vector<StampedImage> requireNumberedFiles(const fs::path& folder, const std::string& prefix,
                                               const std::string& suffix) {
  std::vector<StampedImage> files = listNumberedFiles(folder, prefix, suffix);
  if (files.empty()) {
    throw std::runtime_error("'" + folder.string() + "' has no " + prefix + "NUMBER" + suffix);
  }
  return files;
}

}  // namespace dtsdf
