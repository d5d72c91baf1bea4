/// Simulated flight over endless hilly ground, so that the map keeps growing.
#pragma once

#include <functional>
#include <vector>

#include "benchmark/measurement.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// Height of the ground at position (x, y) in the map frame W, in metres.
double groundHeight(double x_m, double y_m);

/// Renders a depth image for a camera looking straight down from 4 m above the mean ground level.
/// @param x_m Position of the camera along x of W; y is 0.
SourceFrame renderFlightFrame(double x_m);

/// Flies until `map_bytes` are mapped, including blocks on disk and dropped blocks. Rendering is
/// not timed. Calls `show_progress` with the FrameTime::mapped_bytes of each frame.
/// @param speed_m Distance flown per frame, in metres.
/// @param returns Whether to fly back along the same path.
std::vector<FrameTime> fly(ProbedMapper& mapper, size_t map_bytes, double speed_m, bool returns,
                           const std::function<void(size_t)>& show_progress);

}  // namespace dtsdf
