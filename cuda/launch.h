/// Grid sizes, and small helpers that all stages' kernels share. For .cu files.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kernels/core/camera.h"

namespace dtsdf {
namespace gpu {

constexpr int kThreads = 256;

inline unsigned blocksFor(size_t items, int threads = kThreads) {
  return static_cast<unsigned>((items + threads - 1) / threads);
}

#ifdef __CUDACC__
/// A grid of stretches of rows of an image.
inline dim3 rowGrid(const FrameView& frame) {
  constexpr int kMaxGridRows = 65535;
  return dim3(blocksFor(frame.width), frame.height < kMaxGridRows ? frame.height : kMaxGridRows);
}

__device__ __forceinline__ size_t globalThread() {
  return static_cast<size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
}

/// A read that sees what other blocks of threads have written meanwhile.
template <class T>
__device__ __forceinline__ T readShared(const T* p) {
  return *static_cast<const volatile T*>(p);
}
#endif

}  // namespace gpu
}  // namespace dtsdf
