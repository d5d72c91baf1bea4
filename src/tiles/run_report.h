/// What a run of tiles came to, as DIR/report.json.
#pragma once

#include <map>
#include <string>

#include "tiles/merge_tiles.h"
#include "tiles/tile_queue.h"

namespace dtsdf {

struct RunReport {
  int processes = 0;
  double fuse_s = 0.0;          ///< Wall time, until the last tile was done.
  std::map<size_t, int> maker;  ///< Of the tiles made in this run, the process.
  std::string failure;          ///< Why nothing was merged; empty: all is well.
  MergeResult merged;
};

void saveReport(const RunReport& report, const std::string& folder, const LoadedPlan& plan,
                const TileQueue& queue);

}  // namespace dtsdf
