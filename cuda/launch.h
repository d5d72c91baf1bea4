/// Grid sizes, and small helpers that all stages' kernels share.
#pragma once

#include <cstddef>
#include <type_traits>

#include "kernels/core/camera.h"
#include "runtime/stream.h"

namespace dtsdf {
namespace gpu {

constexpr int kThreads = 256;  ///< Threads per block.

/// Blocks of threads for so many items, one thread each.
inline unsigned blocksFor(size_t items) {
  return static_cast<unsigned>((items + kThreads - 1) / kThreads);
}

#ifdef __CUDACC__
/// A grid of stretches of rows of an image, of so many pixels each.
inline dim3 rowGrid(const FrameView& frame, int stretch = kThreads) {
  constexpr int kMaxGridRows = 65535;
  return dim3((frame.width + stretch - 1) / stretch,
              frame.height < kMaxGridRows ? frame.height : kMaxGridRows);
}

/// Whether kernels of this binary wait for the one ahead themselves: all are made alike.
inline bool waitThemselves(const void* kernel) {
  static const bool they_do = [kernel] {
    constexpr int kLeastVersion = 90;
    cudaFuncAttributes attributes;
    if (cudaFuncGetAttributes(&attributes, kernel) != cudaSuccess) return false;
    return attributes.ptxVersion >= kLeastVersion;
  }();
  return they_do;
}

/// Starts a kernel. @throws BackendError with its name if that is refused.
template <class... Parameters>
void launch(const char* name, void (*kernel)(Parameters...), dim3 blocks, int threads,
            size_t shared_bytes, const Stream& stream,
            std::common_type_t<Parameters>... arguments) {
  kernel<<<blocks, threads, shared_bytes, stream.get()>>>(arguments...);
  checkLaunch(name);
}

/// Starts a kernel before the one ahead of it on the stream has ended, where device and binary can:
/// it calls waitForPreviousKernel() first, or waitAtEnd() last.
template <class... Parameters>
void launchOverlapped(const char* name, void (*kernel)(Parameters...), dim3 blocks, int threads,
                      size_t shared_bytes, const Stream& stream,
                      std::common_type_t<Parameters>... arguments) {
  void* addresses[] = {&arguments...};
  const auto* address = reinterpret_cast<const void*>(kernel);
#if CUDART_VERSION >= 11080
  cudaLaunchConfig_t config = {};
  config.gridDim = blocks;
  config.blockDim = dim3(threads);
  config.dynamicSmemBytes = shared_bytes;
  config.stream = stream.get();
  cudaLaunchAttribute early = {};
  early.id = cudaLaunchAttributeProgrammaticStreamSerialization;
  early.val.programmaticStreamSerializationAllowed = 1;
  config.attrs = &early;
  config.numAttrs = stream.startsEarly() && waitThemselves(address) ? 1 : 0;
  cudaLaunchKernelExC(&config, address, addresses);
#else
  cudaLaunchKernel(address, blocks, dim3(threads), addresses, shared_bytes, stream.get());
#endif
  checkLaunch(name);
}

/// The first thing that all threads of such a kernel do: what the one ahead has written is there
/// then, and the next one may start.
__device__ __forceinline__ void waitForPreviousKernel() {
#if CUDART_VERSION >= 11080 && __CUDA_ARCH__ >= 900
  cudaGridDependencySynchronize();
  cudaTriggerProgrammaticLaunchCompletion();
#endif
}

/// The last thing that they do in a kernel that works beside the one ahead, since it has no part in
/// what that does: all ahead of that one have ended by then. Few wait, so that the others make
/// room.
__device__ __forceinline__ void waitAtEnd() {
  if (blockIdx.x + blockIdx.y == 0) waitForPreviousKernel();
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
  __syncthreads();
  if (threadIdx.x == 0) {  // its fences are for all that were waited for, or wait
    __threadfence();
    is_last = atomicAdd(finished, 1u) == blocks - 1;
    __threadfence();
  }
  __syncthreads();
  return is_last;
}
#endif

}  // namespace gpu
}  // namespace dtsdf
