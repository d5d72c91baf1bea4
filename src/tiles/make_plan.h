/// Makes a plan: the way of every frame through the mapper, but for the map itself.
#pragma once

#include <string>
#include <vector>

#include "map/block_table.h"
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

/// A tile cut until no part takes more than `most_bytes`. `blocks` are those of the whole map, by
/// packed key. @throws std::runtime_error where a single block takes more.
std::vector<Tile> cutToBudget(const Tile& tile, const std::vector<BlockRequest>& blocks,
                              size_t most_bytes);

}  // namespace dtsdf
