/// Lists files by the numbers in their names.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/recorded_images.h"

namespace dtsdf {

/// The files for whose names `stampOf` returns a stamp, sorted by stamp. Empty if the folder does
/// not exist.
std::vector<StampedImage> listFiles(
    const std::filesystem::path& folder,
    const std::function<std::optional<double>(const std::filesystem::path&)>& stampOf);

/// The files named `prefix`, digits, `suffix`, sorted by number. Leading zeros are optional.
std::vector<StampedImage> listNumberedFiles(const std::filesystem::path& folder,
                                            const std::string& prefix, const std::string& suffix);

}  // namespace dtsdf
