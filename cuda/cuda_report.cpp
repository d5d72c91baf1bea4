#include "cuda_backend.h"
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
  return report;
}

size_t cudaMemoryTaken() {
  size_t free = 0, total = 0;
  DTSDF_CHECK_CUDA(cudaMemGetInfo(&free, &total));
  return total - free;
}

}  // namespace dtsdf
