#include "runtime/check.h"

#include <atomic>
#include <cstring>

namespace dtsdf {
namespace gpu {
namespace {

/// Number of calls up to and including the one that fails; 0 if none is to fail.
std::atomic<uint64_t> calls_to_failure{0};
std::atomic<cudaError_t> failure{cudaSuccess};

[[noreturn]] void throwFailed(cudaError_t code, const std::string& call) {
  throw BackendError(code == cudaErrorMemoryAllocation,
                     "CUDA error in " + call + ": " + cudaGetErrorName(code) + ", " +
                         cudaGetErrorString(code) +
                         (isLost(code) ? "; this process can no longer use the GPU: save the "
                                         "mesh if there is one, then restart the node"
                                       : ""));
}

/// The call, with its file and line.
std::string callWithPlace(const char* call, const char* file, int line) {
  const char* slash = std::strrchr(file, '/');
  return std::string(call) + " (" + (slash == nullptr ? file : slash + 1) + ":" +
         std::to_string(line) + ")";
}

}  // namespace

bool isLost(cudaError_t code) {
  switch (code) {
    case cudaErrorIllegalAddress:
    case cudaErrorLaunchFailure:
    case cudaErrorLaunchTimeout:
    case cudaErrorHardwareStackError:
    case cudaErrorIllegalInstruction:
    case cudaErrorMisalignedAddress:
    case cudaErrorInvalidAddressSpace:
    case cudaErrorInvalidPc:
    case cudaErrorAssert:
    case cudaErrorECCUncorrectable:
    case cudaErrorNvlinkUncorrectable:
    case cudaErrorDevicesUnavailable:
    case cudaErrorContextIsDestroyed:
    case cudaErrorUnknown: return true;
    default: return false;
  }
}

void failCall(uint64_t n, cudaError_t code) {
  failure = code;
  calls_to_failure = n;
}

bool shouldFail() {
  uint64_t left = calls_to_failure.load(std::memory_order_relaxed);
  if (left == 0) return false;  // always, except in tests
  if (left == 1) {
    if (!isLost(failure)) calls_to_failure = 0;
    return true;
  }
  calls_to_failure = left - 1;
  return false;
}

void throwInjectedFailure(const char* call, const char* file, int line) {
  throwFailed(failure, callWithPlace(call, file, line));
}

void checkCall(cudaError_t code, const char* call, const char* file, int line) {
  if (code == cudaSuccess) return;
  cudaGetLastError();  // a recoverable error must not be reported again by the next launch
  throwFailed(code, callWithPlace(call, file, line));
}

void checkLaunch(const char* kernel) {
  const cudaError_t code = shouldFail() ? failure.load() : cudaGetLastError();
  if (code != cudaSuccess) throwFailed(code, std::string("launch of ") + kernel);
}

}  // namespace gpu
}  // namespace dtsdf
