/// Files that differ by a number in their names, as most layouts have their images.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/recorded_images.h"

namespace dtsdf {

/// The files of a folder whose names are `prefix`, digits and `suffix`, by number; the number is
/// their stamp. Numbers need no leading zeros. Empty if there is no such folder.
std::vector<StampedImage> listNumberedFiles(const std::filesystem::path& folder,
                                            const std::string& prefix, const std::string& suffix);

/// Lists them in the same way. @throws std::runtime_error that names the files if there is none.
std::vector<StampedImage> requireNumberedFiles(const std::filesystem::path& folder,
                                               const std::string& prefix,
                                               const std::string& suffix);

}  // namespace dtsdf
