/// A synthetic flight over endless hilly ground, which makes the map grow.
#pragma once

#include <functional>
#include <vector>

#include "benchmark/measurement.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// Height of the ground, in metres, at x and y of the map frame W.
double groundHeight(double x_m, double y_m);

/// Depth image from a camera looking straight down from 4 m above the mean ground level.
/// @param x_m Position of the camera along x of W; y is 0.
SourceFrame renderFlightFrame(double x_m);

/// Flies until `map_bytes` are mapped, including paged and dropped blocks. Rendering is not timed.
/// `show_progress` is called with the FrameTime::mapped_bytes of each frame.
/// @param speed_m Distance flown per frame.
/// @param returns Whether the camera also flies back the same way.
std::vector<FrameTime> fly(ProbedMapper& mapper, size_t map_bytes, double speed_m, bool returns,
                           const std::function<void(size_t)>& show_progress);

}  // namespace dtsdf
