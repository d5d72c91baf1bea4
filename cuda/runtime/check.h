/// Checks for CUDA calls and kernel launches.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>
#include <string>

#include "backend/backend_error.h"

namespace dtsdf {
namespace gpu {

/// Whether a process can no longer use the GPU after this error and must be restarted.
bool isLost(cudaError_t code);

/// For tests: makes the n-th checked call after this one, counted from 1, fail with `code`; if
/// isLost(code), all calls after it fail too. A failing call is not executed, except for a
/// kernel launch. With n = 0, no call fails.
void failCall(uint64_t n, cudaError_t code);

/// Counts a call that is about to be made. @return whether it must fail.
bool shouldFail();
[[noreturn]] void throwInjectedFailure(const char* call, const char* file, int line);

/// @throws BackendError with the call, its file and line, and CUDA's message, unless `code` is
/// success.
void checkCall(cudaError_t code, const char* call, const char* file, int line);

/// Call this after a launch. @throws BackendError if the launch was refused. Does not wait, so
/// errors inside the kernel are reported by a later call.
void checkLaunch(const char* kernel);

}  // namespace gpu
}  // namespace dtsdf

#define DTSDF_CHECK_CUDA(call)                                                                \
  (::dtsdf::gpu::shouldFail() ? ::dtsdf::gpu::throwInjectedFailure(#call, __FILE__, __LINE__) \
                              : ::dtsdf::gpu::checkCall((call), #call, __FILE__, __LINE__))
