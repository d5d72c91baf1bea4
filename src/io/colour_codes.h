/// Decodes PNG and JPEG colour images, and encodes PNGs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "io/raster.h"

namespace dtsdf {

/// Recognises the format by the first bytes. Converts grey to RGB and 16 bits to 8, and drops
/// transparency. `name` is the image's name in error texts.
/// @throws std::runtime_error if the image is damaged, of another format, an interlaced PNG of 16
/// bits, or has too many pixels.
RgbImage decodeColour(const uint8_t* data, size_t bytes, const std::string& name);

/// Decodes a file like decodeColour().
/// @throws std::runtime_error that names the file, including if it is missing.
RgbImage readColourImage(const std::string& path);

/// Encodes an image as a PNG file in memory. @throws std::runtime_error if libpng fails.
std::string encodeColourPng(const RgbImage& image);

}  // namespace dtsdf
