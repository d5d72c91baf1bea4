/// The one check of CUDA calls and the one of kernel launches.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>
#include <string>

#include "backend/backend_error.h"

namespace dtsdf {
namespace gpu {

/// Whether a process that has met this error can use the GPU no more, but has to be started anew.
bool isLost(cudaError_t code);

/// For tests: the n-th checked call from now on, from 1, is not made and fails with `code`, and so
/// do all after it where the GPU is lost by that. 0: all are made again.
void failCall(uint64_t n, cudaError_t code);

/// Whether the call that is about to be made has to fail; counts it.
bool isToFail();
[[noreturn]] void failAsTold(const char* call, const char* file, int line);

/// @throws BackendError with the call's text, file and line, and what CUDA says, unless `code` is
/// success.
void checkCall(cudaError_t code, const char* call, const char* file, int line);

/// After a launch. @throws BackendError if it was refused; what goes wrong inside the kernel shows
/// in a later call, since nothing waits here.
void checkLaunch(const char* kernel);

}  // namespace gpu
}  // namespace dtsdf

#define DTSDF_CHECK_CUDA(call)                                                    \
  (::dtsdf::gpu::isToFail() ? ::dtsdf::gpu::failAsTold(#call, __FILE__, __LINE__) \
                            : ::dtsdf::gpu::checkCall((call), #call, __FILE__, __LINE__))
