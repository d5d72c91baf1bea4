/// Writes colour images as PNG, by libpng alone.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace dtsdf {

/// Red, green and blue of each pixel, row by row from the top.
struct ColourImage {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb;
};

/// The bytes of a file. @throws std::runtime_error if libpng cannot make them.
std::string encodeColourPng(const ColourImage& image);

}  // namespace dtsdf
