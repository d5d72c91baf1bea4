/// Lists files by the numbers in their names.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/recorded_images.h"

namespace dtsdf {

/// Lists the files whose names `stampOf` converts to a stamp, sorted by stamp. Empty if the folder
/// does not exist.
std::vector<StampedImage> listFiles(
    const std::filesystem::path& folder,
    const std::function<std::optional<double>(const std::filesystem::path&)>& stampOf);

/// Lists the files whose names consist of `prefix`, digits and `suffix`, sorted by number. Leading
/// zeros are optional.
std::vector<StampedImage> listNumberedFiles(const std::filesystem::path& folder,
                                            const std::string& prefix, const std::string& suffix);

}  // namespace dtsdf
