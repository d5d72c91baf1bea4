/// Decodes PNG and JPEG colour images, and encodes PNGs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "io/raster.h"

namespace dtsdf {

/// Detects the format from the first bytes. Converts grey to RGB and 16 bits to 8, and drops
/// transparency. `name` identifies the image in error messages.
/// @throws std::runtime_error if the image is damaged, in another format, an interlaced 16-bit PNG,
/// or too large.
RgbImage decodeColour(const uint8_t* data, size_t bytes, const std::string& name);

/// Decodes an image file; see decodeColour().
/// @throws std::runtime_error that names the file, if it cannot be read or decoded.
RgbImage readColourImage(const std::string& path);

/// Encodes an image as a PNG file in memory. @throws std::runtime_error if libpng fails.
std::string encodeColourPng(const RgbImage& image);

}  // namespace dtsdf
