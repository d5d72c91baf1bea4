/// A synthetic flight over endless hilly ground: every frame adds new blocks, so the map grows
/// until memory runs out.
#pragma once

#include <functional>
#include <vector>

#include "benchmark/measurement.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// Height of the ground, in metres, at x and y of the map frame W.
double groundHeight(double x_m, double y_m);

/// Depth image of a camera that looks straight down from 4 m above the mean ground.
SourceFrame renderFlightFrame(double x_m);

struct FlightPlan {
  size_t map_bytes;      ///< Size at which the flight ends, including dropped blocks.
  double speed_m;        ///< Distance flown per frame.
  bool returns = false;  ///< Whether it also flies back the same way.
};

/// Flies until `plan.map_bytes` were mapped. Images are rendered outside the timing.
/// `show_progress` gets the bytes mapped so far.
std::vector<FrameTime> fly(ProbedMapper& mapper, const FlightPlan& plan,
                           const std::function<void(size_t)>& show_progress);

}  // namespace dtsdf
