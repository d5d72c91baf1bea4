/// The figures of `benchmark`, as JSON and as tables for a terminal.
#pragma once

#include <string>

#include "benchmark/measurement.h"
#include "mapper/gpu.h"

namespace dtsdf {

/// Rates of copies: each byte is read and written.
struct CopyRates {
  double memory_gb_s = 0.0;
  double upload_gb_s = 0.0, download_gb_s = 0.0;  ///< 0 without a GPU.
};

struct Report {
  std::string json, text;
};

/// Median, p95 and worst leave out the first frame, which takes all memory for the first time.
Report reportMeasurement(const Measurement& measurement, const CopyRates& rates);

/// By GiB of the map: does the time of a frame stay the same?
Report reportFlight(const std::vector<FrameTime>& times, const Measurement& end);

Report reportGpuAndKernels(const GpuReport& gpu);

}  // namespace dtsdf
