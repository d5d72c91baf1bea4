/// The figures of `benchmark`, as JSON.
#pragma once

#include <string>

#include "benchmark/measurement.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// Median, p95 and worst leave out the first frame, which takes all memory for the first time.
std::string reportMeasurement(const Measurement& measurement);

/// Frame times per GiB of the map: do they stay the same?
std::string reportFlight(const std::vector<FrameTime>& times, const Measurement& end);

}  // namespace dtsdf
