/// The pixels of an image in memory, in row-major order from the top.
#pragma once

#include <cstdint>
#include <vector>

namespace dtsdf {

template <class Value>
struct Raster {
  int width = 0, height = 0;  ///< In pixels; a pixel may have several values.
  std::vector<Value> values;
};

using RgbImage = Raster<uint8_t>;     ///< Red, green and blue of each pixel.
using DepthImage = Raster<uint16_t>;  ///< One value per pixel.

}  // namespace dtsdf
