/// Makes a plan: the way of every frame through the mapper, but for the map itself.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "map/memory_budget.h"
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

/// The tile of these blocks, cut until no part takes more than the budget; those that have nothing
/// to make are left out. `describe` makes a tile of its own blocks.
/// @throws std::runtime_error where a single block takes more.
std::vector<Tile> cutToBudget(const BlockExtent& own, const MemoryBudget& budget,
                              const std::function<Tile(const BlockExtent&)>& describe);

}  // namespace dtsdf
