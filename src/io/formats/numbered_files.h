/// Files that differ by a number in their names, as most layouts have their images.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/recorded_images.h"

namespace dtsdf {

/// The files of a folder in the order of what `stampOf` has for their names, but for those that it
/// has none for. Empty if there is no such folder.
std::vector<StampedImage> listFiles(
    const std::filesystem::path& folder,
    const std::function<std::optional<double>(const std::filesystem::path&)>& stampOf);

/// Those whose names are `prefix`, digits and `suffix`, by number. Numbers need no leading zeros.
std::vector<StampedImage> listNumberedFiles(const std::filesystem::path& folder,
                                            const std::string& prefix, const std::string& suffix);

}  // namespace dtsdf
