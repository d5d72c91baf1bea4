/// The figures of `benchmark`, as JSON.
#pragma once

#include <string>

#include "benchmark/measurement.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// `median`, `p95` and `worst` exclude the first frame, which allocates memory, except in
/// `fusion_ms` or if there is only one frame.
std::string reportMeasurement(const Measurement& measurement);

/// Frame times by GiB of mapped data, to show whether they stay constant.
std::string reportFlight(const std::vector<FrameTime>& times, const Measurement& end);

}  // namespace dtsdf
