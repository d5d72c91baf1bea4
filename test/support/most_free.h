/// The greatest free depths of an image's patches, pixel by pixel.
#pragma once

#include <vector>

#include "kernels/fusion/free_patches.h"

namespace dtsdf {

inline std::vector<float> mostFreeOf(const FrameView& frame, const std::vector<float>& free_depth) {
  const int32_t across = freePatchesAlong(frame.width);
  std::vector<float> patches(static_cast<size_t>(across) * freePatchesAlong(frame.height), 0.0f);
  for (int32_t v = 0; v < frame.height; ++v) {
    for (int32_t u = 0; u < frame.width; ++u) {
      float& patch = patches[static_cast<size_t>(v / kFreePatchSide) * across + u / kFreePatchSide];
      patch = maximum(patch, free_depth[pixelIndex(frame, {u, v})]);
    }
  }
  return patches;
}

}  // namespace dtsdf
