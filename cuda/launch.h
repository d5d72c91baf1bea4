/// Kernel launches, and helpers that all kernels share.
#pragma once

#include <cstddef>
#include <type_traits>

#include "kernels/core/camera.h"
#include "runtime/stream.h"

namespace dtsdf {
namespace gpu {

constexpr int kThreads = 256;  ///< Threads per thread block of most kernels.

/// Number of thread blocks for `items` items, one thread each.
inline unsigned blocksFor(size_t items) {
  return static_cast<unsigned>((items + kThreads - 1) / kThreads);
}

#ifdef __CUDACC__
/// A grid with one thread block per `stretch` pixels of each image row. As the grid may have fewer
/// rows than the image, kernels loop over rows in steps of gridDim.y.
inline dim3 rowGrid(const FrameView& frame, int stretch = kThreads) {
  constexpr int kMaxGridRows = 65535;
  return dim3((frame.width + stretch - 1) / stretch,
              frame.height < kMaxGridRows ? frame.height : kMaxGridRows);
}

/// Whether waitForPreviousKernel() has an effect in the code for this device. The answer is the
/// same for all kernels.
inline bool kernelsCanOverlap(const void* kernel) {
  static const bool they_do = [kernel] {
    constexpr int kMinVersion = 90;
    cudaFuncAttributes attributes;
    if (cudaFuncGetAttributes(&attributes, kernel) != cudaSuccess) return false;
    return attributes.ptxVersion >= kMinVersion;
  }();
  return they_do;
}

/// Starts a kernel. @throws BackendError with its name if the launch is refused.
template <class... Parameters>
void launch(const char* name, void (*kernel)(Parameters...), dim3 blocks, int threads,
            size_t shared_bytes, const Stream& stream,
            std::common_type_t<Parameters>... arguments) {
  kernel<<<blocks, threads, shared_bytes, stream.get()>>>(arguments...);
  checkLaunch(name);
}

/// Starts a kernel before the previous one on the stream has ended, if device and binary support
/// it. The kernel must call waitForPreviousKernel() first or waitAtEnd() last.
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
  config.numAttrs = stream.canOverlapKernels() && kernelsCanOverlap(address) ? 1 : 0;
  cudaLaunchKernelExC(&config, address, addresses);
#else
  cudaLaunchKernel(address, blocks, dim3(threads), addresses, shared_bytes, stream.get());
#endif
  checkLaunch(name);
}

/// All threads of an overlapped kernel must call this first. On return, everything that the
/// previous kernel wrote is visible, and the next kernel may start.
__device__ __forceinline__ void waitForPreviousKernel() {
#if CUDART_VERSION >= 11080 && __CUDA_ARCH__ >= 900
  cudaGridDependencySynchronize();
  cudaTriggerProgrammaticLaunchCompletion();
#endif
}

/// For kernels that may overlap the previous kernel and do not depend on it: all threads must call
/// this last. When such a kernel starts, all kernels before the previous one have ended. Only one
/// thread block waits; the others release their multiprocessors.
__device__ __forceinline__ void waitAtEnd() {
  if (blockIdx.x + blockIdx.y == 0) waitForPreviousKernel();
}

__device__ __forceinline__ size_t globalThread() {
  return static_cast<size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
}

/// Reads a value that other thread blocks may have written in the meantime.
template <class T>
__device__ __forceinline__ T readShared(const T* p) {
  return *static_cast<const volatile T*>(p);
}

/// Whether this thread block is the last of `blocks` to call this. If so, reads that bypass the L1
/// cache, such as readShared(), return what the other thread blocks wrote before their calls. @pre
/// `finished` was 0 at the start of the kernel.
__device__ __forceinline__ bool isLastBlock(uint32_t* finished, uint32_t blocks) {
  __shared__ bool is_last;
  __syncthreads();
  if (threadIdx.x == 0) {  // together with the barriers, the fences cover all threads
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
