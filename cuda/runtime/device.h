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

/// Makes `device` the current device of the calling thread, as a mapper may be used from any
/// thread.
void useDevice(int device);

/// Why kernels of this binary cannot run on the current device; empty if they can.
/// @param kernel Any kernel of the binary.
std::string findDeviceProblem(const void* kernel);

}  // namespace gpu
}  // namespace dtsdf
