/// Depth and colour images as PNG and JPEG files, PNG by OpenCV, JPEG by TurboJPEG.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/raster.h"

namespace dtsdf {

// The size that a file announces is checked before memory is taken for it.

/// The pixels of a depth image in a file, row by row.
/// @throws std::runtime_error that names the file, if it is missing, damaged, not 16-bit grey, or
/// not of the expected size.
std::vector<uint16_t> readDepthPng(const std::string& path, int width, int height);

/// A depth image in a file without its pixels, for its size.
/// @throws std::runtime_error that names the file, if it is missing, damaged or not 16-bit grey.
DepthImage readDepthPngSize(const std::string& path);

/// A depth image in memory.
/// @throws std::runtime_error if it is damaged, not 16-bit grey, or larger than images may be.
DepthImage decodeDepthPng(const uint8_t* data, size_t bytes);

/// The bytes of a file. @throws std::exception if OpenCV cannot make them.
std::string encodeDepthPng(DepthImage image);

/// A colour image in memory, PNG or JPEG by its first bytes. Grey images become coloured, 16 bits
/// become 8, transparency is left out, and so is the orientation that a camera noted. `name` is
/// what stands for the image in messages.
/// @throws std::runtime_error if it is damaged, of another format, or larger than a map takes.
RgbImage decodeColour(const uint8_t* data, size_t bytes, const std::string& name);

/// Decodes a file in the same way. @throws std::runtime_error that names it, also if it is missing.
RgbImage readColourImage(const std::string& path);

/// The bytes of a PNG file. @throws std::exception if OpenCV cannot make them.
std::string encodeColourPng(RgbImage image);

}  // namespace dtsdf
