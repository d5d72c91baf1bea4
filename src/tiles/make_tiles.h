/// Cuts what frames came by into tiles, and finds what each needs.
#pragma once

#include <functional>
#include <vector>

#include "map/memory_budget.h"
#include "tiles/colour_reach.h"
#include "tiles/frame_ledger.h"

namespace dtsdf {

/// A colour image that paints.
struct ImageInWork {
  RecordedIndex number;
  PinholeView view;
};

/// All that tiles are made of.
struct TileSources {
  const FrameLedger& ledger;
  const std::vector<ImageInWork>& colour_images;
  const ColourReach& colour_reach;
  const MapperParams& params;
  int tile_blocks;            ///< Edge of a tile.
  double seconds_of_a_frame;  ///< Of those of the plan.
};

/// The tiles in the order of their places, each cut until it is within the budget.
std::vector<Tile> makeTiles(const TileSources& sources);

/// The tile of these blocks, cut until no part takes more than the budget; those that have nothing
/// to make are left out. `describe` makes a tile of its own blocks.
/// @throws std::runtime_error where a single block takes more.
std::vector<Tile> cutToBudget(const BlockExtent& own, const MemoryBudget& budget,
                              const std::function<Tile(const BlockExtent&)>& describe);

}  // namespace dtsdf
