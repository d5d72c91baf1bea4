/// Formats the measurements of `benchmark` as JSON.
#pragma once

#include <string>

#include "benchmark/measurement.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// Report of measure(). `median`, `p95` and `worst` exclude the first frame, which allocates
/// memory, unless there is only one frame; `fusion_ms` includes it.
std::string reportMeasurement(const Measurement& measurement);

/// Report of fly(): frame times for each GiB by which the map has grown, to show whether they stay
/// constant.
std::string reportFlight(const std::vector<FrameTime>& times, const Measurement& end);

}  // namespace dtsdf
