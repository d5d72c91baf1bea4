#include "io/formats/numbered_files.h"

#include <algorithm>
#include <tuple>

#include "params/text.h"

namespace dtsdf {

namespace fs = std::filesystem;

std::vector<StampedImage> listFiles(
    const fs::path& folder, const std::function<std::optional<double>(const fs::path&)>& stampOf) {
  std::vector<StampedImage> files;
  if (!fs::is_directory(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::optional<double> stamp_s = stampOf(entry.path().filename());
    if (stamp_s) files.push_back({*stamp_s, entry.path().string()});
  }
  std::sort(files.begin(), files.end(), [](const StampedImage& a, const StampedImage& b) {
    return std::tie(a.stamp_s, a.path) < std::tie(b.stamp_s, b.path);
  });
  return files;
}

std::vector<StampedImage> listNumberedFiles(const fs::path& folder, const std::string& prefix,
                                            const std::string& suffix) {
  return listFiles(folder, [&](const std::string& name) -> std::optional<double> {
    const size_t around = prefix.size() + suffix.size();
    if (name.size() <= around || name.rfind(prefix, 0) != 0 || !endsWith(name, suffix)) return {};
    const std::string digits = name.substr(prefix.size(), name.size() - around);
    long long number = 0;
    const bool is_number = digits.find_first_not_of("0123456789") == std::string::npos;
    if (!is_number || !parseNumber(digits, number)) return {};
    return static_cast<double>(number);
  });
}

}  // namespace dtsdf
