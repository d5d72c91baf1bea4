/// A synthetic flight over hilly ground without end: every frame brings new blocks, so the map
/// grows as far as memory goes.
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
  size_t map_bytes;      ///< At which the flight ends, with those of blocks that were dropped.
  double speed_m;        ///< Way from frame to frame.
  bool returns = false;  ///< It flies back the way that it came.
};

/// Flies until so much was mapped; frames are made between the timed ones. `show_progress` gets
/// what was mapped so far.
std::vector<FrameTime> fly(ProbedMapper& mapper, const FlightPlan& plan,
                           const std::function<void(size_t)>& show_progress);

}  // namespace dtsdf
