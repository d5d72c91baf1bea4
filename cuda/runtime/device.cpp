#include "runtime/device.h"

#include "runtime/check.h"

namespace dtsdf {
namespace gpu {
namespace {

std::string versionText(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

std::string findDriverProblem() {
  int driver = 0, runtime = 0, devices = 0;
  if (cudaDriverGetVersion(&driver) != cudaSuccess || driver == 0) {
    return "no NVIDIA driver is installed";
  }
  cudaRuntimeGetVersion(&runtime);
  const cudaError_t error = cudaGetDeviceCount(&devices);
  cudaGetLastError();
  if (error == cudaErrorInsufficientDriver) {
    return "the NVIDIA driver is too old and must be updated: it supports CUDA " +
           versionText(driver) + ", but this program was built with CUDA " + versionText(runtime);
  }
  if (error == cudaErrorNoDevice || (error == cudaSuccess && devices == 0)) {
    return "the driver finds no CUDA device";
  }
  if (error == cudaSuccess) return "";
  return std::string("CUDA could not be initialised: ") + cudaGetErrorString(error);
}

}  // namespace

int currentDevice() {
  int device = 0;
  DTSDF_CHECK_CUDA(cudaGetDevice(&device));
  return device;
}

std::string deviceName() {
  cudaDeviceProp properties;
  DTSDF_CHECK_CUDA(cudaGetDeviceProperties(&properties, currentDevice()));
  return properties.name;
}

int multiprocessorCount() {
  int count = 0;
  DTSDF_CHECK_CUDA(cudaDeviceGetAttribute(&count, cudaDevAttrMultiProcessorCount, currentDevice()));
  return count;
}

size_t freeDeviceMemory() {
  size_t free = 0, total = 0;
  DTSDF_CHECK_CUDA(cudaMemGetInfo(&free, &total));
  return free;
}

void useDevice(int device) { DTSDF_CHECK_CUDA(cudaSetDevice(device)); }

std::string findDeviceProblem(const void* kernel) {
  const std::string driver_problem = findDriverProblem();
  if (!driver_problem.empty()) return driver_problem;
  cudaFuncAttributes attributes;
  const cudaError_t error = cudaFuncGetAttributes(&attributes, kernel);
  cudaGetLastError();
  if (error == cudaSuccess) return "";
  int major = 0, minor = 0;
  const int device = currentDevice();
  DTSDF_CHECK_CUDA(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
  DTSDF_CHECK_CUDA(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device));
  if (error == cudaErrorNoKernelImageForDevice || error == cudaErrorInvalidDeviceFunction ||
      error == cudaErrorUnsupportedPtxVersion) {
    return "the binary has no code for compute capability " + std::to_string(major) + "." +
           std::to_string(minor) + " of " + deviceName() +
           "; rebuild with -DCMAKE_CUDA_ARCHITECTURES=" + std::to_string(major) +
           std::to_string(minor);
  }
  return deviceName() + " cannot be used: " + cudaGetErrorString(error);
}

}  // namespace gpu
}  // namespace dtsdf
