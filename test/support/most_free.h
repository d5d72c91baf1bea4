/// The greatest free depths of an image's tiles, pixel by pixel.
#pragma once

#include <vector>

#include "kernels/fusion/free_tiles.h"

namespace dtsdf {

inline std::vector<float> mostFreeOf(const FrameView& frame, const std::vector<float>& free_depth) {
  std::vector<float> tiles;
  for (const int side_log2 : {kFineTileLog2, kCoarseTileLog2}) {
    const size_t first = tiles.size();
    tiles.resize(first + static_cast<size_t>(tileCount(frame, side_log2)), 0.0f);
    for (int32_t v = 0; v < frame.height; ++v) {
      for (int32_t u = 0; u < frame.width; ++u) {
        float& tile =
            tiles[first + static_cast<size_t>(v >> side_log2) * tilesAlong(frame.width, side_log2) +
                  (u >> side_log2)];
        tile = maximum(tile, free_depth[pixelIndex(frame, {u, v})]);
      }
    }
  }
  return tiles;
}

}  // namespace dtsdf
