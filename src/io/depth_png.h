/// Reads and writes 16-bit grey PNG images by libpng alone, so that the programs need no image
/// library beyond.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace dtsdf {

struct ImageSize {
  int width = 0, height = 0;  ///< In pixels.
};

/// 16-bit pixels, row by row.
struct DepthImage {
  ImageSize size;
  std::vector<uint16_t> pixels;
};

/// The pixels of a depth image in a file, row by row.
/// @throws std::runtime_error that names the file, if it is missing, damaged, not 16-bit grey, or
/// not of the expected size.
std::vector<uint16_t> readDepthPng(const std::string& path, ImageSize expected);

/// The size of a depth image in a file, without decoding it.
/// @throws std::runtime_error that names the file, if it is missing, damaged or not 16-bit grey.
ImageSize readDepthPngSize(const std::string& path);

/// A depth image in memory. What its header announces is checked before memory is taken for it.
/// @throws std::runtime_error if it is damaged, not 16-bit grey, or larger than images may be.
DepthImage decodeDepthPng(const uint8_t* data, size_t bytes);

/// The bytes of a file. @throws std::runtime_error if libpng cannot make them.
std::string encodeDepthPng(const DepthImage& image);

}  // namespace dtsdf
