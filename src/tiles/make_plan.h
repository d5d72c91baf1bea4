/// Makes a plan: the way of every frame through the mapper, but for the map itself.
#pragma once

#include <string>
#include <vector>

#include "tiles/plan.h"

namespace dtsdf {

struct PlanRequest {
  InputOptions reading;  ///< But for the path, and for a format that is to be guessed.
  std::vector<std::string> recordings;  ///< Their paths, in the order in which they are fused.
  double tile_m = 20.0;
};

/// A tile that takes more than the budget is cut. `settings` are those of the request's options.
/// @throws std::runtime_error, also for settings with which a tile could not be the same as its
/// part of the whole map.
Plan makePlan(const PlanRequest& request, const RunSettings& settings);

}  // namespace dtsdf
