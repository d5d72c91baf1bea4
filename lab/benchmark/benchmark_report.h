/// The figures of `benchmark`, as JSON and as tables for a terminal.
#pragma once

#include <string>

#include "benchmark/measurement.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

struct Report {
  std::string json, text;
};

/// Median, p95 and worst leave out the first frame, which takes all memory for the first time.
Report reportMeasurement(const Measurement& measurement);

/// By GiB of the map: does the time of a frame stay the same?
Report reportFlight(const std::vector<FrameTime>& times, const Measurement& end);

Report reportGpuRates(const GpuReport& gpu);

}  // namespace dtsdf
