/// The plan of a map in tiles: what is read, with which settings, which frames count, and the
/// tiles. It lies in DIR/plan.json.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "dtsdf_mapping/map_contents.h"
#include "tiles/tile.h"
#include "tools/run_options.h"

namespace dtsdf {

/// A colour image of a recording, by SourceColour::index, and how many of the recording's fused
/// frames come before it.
struct PlannedImage {
  size_t index, frames_before;
};

/// A recording and what the whole map makes of its frames, by their place in the recording.
struct PlannedRecording {
  std::string path, format;
  IndexRanges fused;                 ///< Those that become part of the map.
  IndexRanges supporting;            ///< Those of them that touch a block.
  std::vector<PlannedImage> images;  ///< Colour images that paint, in their order.
};

struct Plan : MapOrigin {
  InputOptions reading;  ///< How recordings are read; path and format are in `recordings`.
  ParamTree settings;    ///< As given by files and command line, but for backend and threads.
  double tile_m = 0.0;   ///< As asked for.
  int tile_blocks = 0;   ///< Edge of a tile; those cut further are smaller.
  std::vector<PlannedRecording> recordings;
  std::vector<Tile> tiles;                  ///< By number, from 0 on.
  double seconds = 0.0, processor_s = 0.0;  ///< That the plan took.

  /// The options that a recording is opened with.
  InputOptions inputOf(size_t recording) const;
};

/// A plan and the number that it is known by: of its bytes in the file.
struct LoadedPlan {
  Plan plan;
  std::string id;
};

/// @throws std::runtime_error that names the file and says what to do.
LoadedPlan loadPlan(const std::string& folder);
void savePlan(const Plan& plan, const std::string& folder);

/// The number of the tile with this name. @throws std::runtime_error
size_t readTileNumber(const std::string& text, const Plan& plan);

}  // namespace dtsdf
