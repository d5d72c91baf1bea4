/// Makes all tiles of a plan with the processes of an MPI job, and merges them.
#pragma once

#include "tiles/fuse_tile.h"
#include "tiles/merge_tiles.h"

namespace dtsdf {

struct RunRequest {
  MergeRequest merge;   ///< With the folder of the plan.
  FuseOptions options;  ///< Of each tile. Without threads, processes share those of a machine.
};

/// To be called by each process of the job. Those but the first end quietly.
/// @throws std::runtime_error in the first one with the tiles that failed twice.
void runTiles(const RunRequest& request);

}  // namespace dtsdf
