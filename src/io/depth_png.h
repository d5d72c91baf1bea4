/// Reads 16-bit grey PNG files by libpng alone, so that the programs need no image library beyond.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace dtsdf {

/// The pixels of a depth image, row by row.
/// @throws std::runtime_error that names the file, if it is missing, damaged, not 16-bit grey, or
/// not of the expected size.
std::vector<uint16_t> readDepthPng(const std::string& path, int width, int height);

}  // namespace dtsdf
