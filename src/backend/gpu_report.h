/// What there is to know of the GPU at hand.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace dtsdf {

/// A kernel as it was compiled for the device at hand.
struct KernelUse {
  std::string name;
  int threads;               ///< Of a block of threads, as it is launched.
  int registers;             ///< Of a thread.
  size_t shared_bytes;       ///< Of a block of threads.
  size_t local_bytes;        ///< Of a thread: arrays and spilled registers.
  int blocks_per_processor;  ///< That fit on a multiprocessor at a time.
  double occupancy;          ///< Share of a multiprocessor's warps that these fill.
};

/// The GPU of the calling thread, with the rates of large copies as they are measured here.
struct GpuReport {
  std::string name;
  int compute_capability = 0;  ///< 10 * major + minor.
  int multiprocessors = 0;
  std::string driver, runtime;                    ///< CUDA versions.
  double copy_gb_s = 0.0;                         ///< Device memory, bytes read and bytes written.
  double upload_gb_s = 0.0, download_gb_s = 0.0;  ///< From and to pinned host memory.
  std::vector<KernelUse> kernels;
};

}  // namespace dtsdf
