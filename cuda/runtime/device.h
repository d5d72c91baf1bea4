/// The CUDA device that this process uses.
#pragma once

#include <cstddef>
#include <string>

namespace dtsdf {
namespace gpu {

int currentDevice();
std::string deviceName();
int multiprocessorCount();
size_t freeDeviceMemory();  ///< In bytes.

/// Makes a device the calling thread's current one, since a mapper may be used from any thread.
void useDevice(int device);

/// Why no kernel of this binary can run on the current device; empty if one can. `kernel` is any of
/// the binary's kernels.
std::string findDeviceProblem(const void* kernel);

}  // namespace gpu
}  // namespace dtsdf
