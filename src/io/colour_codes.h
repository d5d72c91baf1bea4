/// Decodes colour images, PNG and JPEG, and makes PNGs of them, by libpng and TurboJPEG alone,
/// so that the programs need no image library beyond.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "io/raster.h"

namespace dtsdf {

/// The format is known by the first bytes. Grey images become coloured, 16 bits become 8,
/// transparency is left out. `name` is what stands for the image in messages.
/// @throws std::runtime_error if it is damaged, of another format, or larger than a map takes.
RgbImage decodeColour(const uint8_t* data, size_t bytes, const std::string& name);

/// Decodes a file in the same way. @throws std::runtime_error that names it, also if it is missing.
RgbImage readColourImage(const std::string& path);

/// The bytes of a PNG file. @throws std::runtime_error if libpng cannot make them.
std::string encodeColourPng(const RgbImage& image);

}  // namespace dtsdf
