/// Reads raw depth images. For .cu files.
#pragma once

#include "kernels/surfels/depth.h"
#include "sense.h"

namespace dtsdf {
namespace gpu {

/// The inverse depth of a pixel of an image so wide.
__device__ __forceinline__ float inverseDepthAt(const RawDepth& raw, int width, int u, int v) {
  const int64_t i = static_cast<int64_t>(v) * width + u;
  const float value = raw.is_uint16 ? static_cast<float>(static_cast<const uint16_t*>(raw.data)[i])
                                    : static_cast<const float*>(raw.data)[i];
  return inverseDepth(value, raw.range);
}

}  // namespace gpu
}  // namespace dtsdf
