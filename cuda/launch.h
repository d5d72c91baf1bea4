/// Grid sizes, and small helpers that all stages' kernels share.
#pragma once

#include <cstddef>

#include "kernels/core/camera.h"

namespace dtsdf {
namespace gpu {

constexpr int kThreads = 256;  ///< Of a block of threads.

/// Blocks of threads for so many items, one thread each.
inline unsigned blocksFor(size_t items) {
  return static_cast<unsigned>((items + kThreads - 1) / kThreads);
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

/// Whether this block of threads is the last of its grid to come here, and so sees what all others
/// have written by then: past the first-level caches, by readShared(). `finished` is 0 before.
__device__ __forceinline__ bool isLastBlock(uint32_t* finished, uint32_t blocks) {
  __shared__ bool is_last;
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) is_last = atomicAdd(finished, 1u) == blocks - 1;
  __syncthreads();
  if (is_last) __threadfence();
  return is_last;
}
#endif

}  // namespace gpu
}  // namespace dtsdf
