/// What there is to know of the GPU at hand.
#pragma once

#include <string>

namespace dtsdf {

/// The GPU of the calling thread, with the rates of large copies as they are measured here.
struct GpuReport {
  std::string name;
  int compute_capability = 0;  ///< 10 * major + minor.
  int multiprocessors = 0;
  std::string driver, runtime;                    ///< CUDA versions.
  double copy_gb_s = 0.0;                         ///< Device memory, bytes read and bytes written.
  double upload_gb_s = 0.0, download_gb_s = 0.0;  ///< From and to pinned host memory.
};

}  // namespace dtsdf
