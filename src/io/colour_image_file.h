/// Reads colour images, PNG and JPEG, by libpng and libjpeg alone, so that the programs need no
/// image library beyond.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace dtsdf {

/// Red, green and blue of each pixel, row by row.
struct ColourImageFile {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb;
};

/// The format is told by the file's first bytes. Grey images become coloured, 16 bits become 8,
/// transparency is left out.
/// @throws std::runtime_error that names the file, if it is missing, damaged, of another format, or
/// larger than a map takes.
ColourImageFile readColourImage(const std::string& path);

}  // namespace dtsdf
