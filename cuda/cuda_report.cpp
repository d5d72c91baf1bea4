#include "cuda_backend.h"
#include "named_kernels.h"
#include "runtime/buffer.h"
#include "runtime/device.h"

namespace dtsdf {
namespace {

using gpu::Event;
using gpu::Stream;

constexpr size_t kCopyBytes = size_t(1) << 28;
constexpr int kCopies = 5;

/// GB/s of the best of some copies of kCopyBytes.
template <class Copy>
double measureCopies(const Stream& stream, const Copy& copy) {
  Event begin(gpu::Timing::kOn), end(gpu::Timing::kOn);
  float best_ms = 0.0f;
  for (int i = 0; i < kCopies; ++i) {
    stream.record(begin);
    copy();
    stream.record(end);
    end.wait();
    const float ms = end.millisecondsSince(begin);
    if (i == 0 || ms < best_ms) best_ms = ms;
  }
  return static_cast<double>(kCopyBytes) / 1e6 / best_ms;
}

void measureRates(GpuReport& report) {
  const Stream stream;
  const gpu::DeviceBuffer<unsigned char> a(kCopyBytes);
  gpu::DeviceBuffer<unsigned char> b(kCopyBytes);
  gpu::PinnedBuffer<unsigned char> host(kCopyBytes);
  report.copy_gb_s = 2.0 * measureCopies(stream, [&] {  // each byte is read and written
                       DTSDF_CHECK_CUDA(cudaMemcpyAsync(b.data(), a.data(), kCopyBytes,
                                                        cudaMemcpyDeviceToDevice, stream.get()));
                     });
  report.upload_gb_s = measureCopies(stream, [&] { b.upload(host.data(), kCopyBytes, stream); });
  report.download_gb_s =
      measureCopies(stream, [&] { b.download(host.data(), kCopyBytes, stream); });
}

KernelUse describe(const gpu::NamedKernel& kernel) {
  cudaFuncAttributes attributes;
  DTSDF_CHECK_CUDA(cudaFuncGetAttributes(&attributes, kernel.function));
  KernelUse use;
  use.name = kernel.name;
  use.threads = kernel.threads;
  use.registers = attributes.numRegs;
  use.shared_bytes = attributes.sharedSizeBytes + kernel.dynamic_shared_bytes;
  use.local_bytes = attributes.localSizeBytes;
  DTSDF_CHECK_CUDA(cudaOccupancyMaxActiveBlocksPerMultiprocessor(
      &use.blocks_per_processor, kernel.function, use.threads, kernel.dynamic_shared_bytes));
  int threads_per_processor = 0;
  DTSDF_CHECK_CUDA(cudaDeviceGetAttribute(
      &threads_per_processor, cudaDevAttrMaxThreadsPerMultiProcessor, gpu::currentDevice()));
  use.occupancy =
      static_cast<double>(use.blocks_per_processor * use.threads) / threads_per_processor;
  return use;
}

std::string versionText(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

int attribute(cudaDeviceAttr name) {
  int value = 0;
  DTSDF_CHECK_CUDA(cudaDeviceGetAttribute(&value, name, gpu::currentDevice()));
  return value;
}

}  // namespace

GpuReport reportCudaDevice() {
  GpuReport report;
  report.name = gpu::deviceName();
  report.compute_capability = 10 * attribute(cudaDevAttrComputeCapabilityMajor) +
                              attribute(cudaDevAttrComputeCapabilityMinor);
  report.multiprocessors = gpu::multiprocessorCount();
  int driver = 0, runtime = 0;
  DTSDF_CHECK_CUDA(cudaDriverGetVersion(&driver));
  DTSDF_CHECK_CUDA(cudaRuntimeGetVersion(&runtime));
  report.driver = versionText(driver);
  report.runtime = versionText(runtime);
  measureRates(report);
  for (const auto& kernels :
       {gpu::alignKernels(), gpu::senseKernels(), gpu::surfelKernels(), gpu::blockKernels(),
        gpu::mapKernels(), gpu::moveKernels(), gpu::carryKernels(), gpu::markKernels(),
        gpu::fusionKernels(), gpu::clearKernels(), gpu::regionKernels(), gpu::freeSpaceKernels(),
        gpu::distanceKernels(), gpu::paintKernels(), gpu::renderKernels(),
        gpu::mesherKernels(true)}) {
    for (const gpu::NamedKernel& kernel : kernels) report.kernels.push_back(describe(kernel));
  }
  return report;
}

size_t cudaMemoryTaken() {
  size_t free = 0, total = 0;
  DTSDF_CHECK_CUDA(cudaMemGetInfo(&free, &total));
  return total - free;
}

}  // namespace dtsdf
