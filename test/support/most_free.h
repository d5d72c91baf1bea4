/// The greatest free depths of an image's patches, pixel by pixel.
#pragma once

#include <vector>

#include "kernels/fusion/free_patches.h"

namespace dtsdf {

inline std::vector<float> mostFreeOf(const FrameView& frame, const std::vector<float>& free_depth) {
  std::vector<float> patches;
  for (const int side_log2 : {kFinePatchLog2, kCoarsePatchLog2}) {
    const size_t first = patches.size();
    patches.resize(first + static_cast<size_t>(freePatchCount(frame, side_log2)), 0.0f);
    for (int32_t v = 0; v < frame.height; ++v) {
      for (int32_t u = 0; u < frame.width; ++u) {
        float& patch =
            patches[first +
                    static_cast<size_t>(v >> side_log2) * freePatchesAlong(frame.width, side_log2) +
                    (u >> side_log2)];
        patch = maximum(patch, free_depth[pixelIndex(frame, {u, v})]);
      }
    }
  }
  return patches;
}

}  // namespace dtsdf
