/// Joins the tiles of a plan into one map and one mesh.
#pragma once

#include <cstdint>
#include <string>

#include "tiles/plan.h"

namespace dtsdf {

struct MergeRequest {
  std::string folder;     ///< Of the plan.
  std::string mesh_path;  ///< A .ply; empty: no mesh.
  std::string map_path;   ///< Empty: no map.
};

struct MergeResult {
  uint64_t vertices = 0, triangles = 0;
  size_t blocks = 0;
  uint64_t content_hash = 0;
  double seconds = 0.0, processor_s = 0.0;
};

/// Of the tiles' voxels and meshes a few blocks each are in memory, and of their tables all: about
/// 60 bytes a block.
/// @throws std::runtime_error that names the tiles that are not there, damaged or of other plans;
/// what is saved is whole, or is not there.
MergeResult mergeTiles(const MergeRequest& request, const LoadedPlan& plan);

/// Says what was saved.
void printMerged(const MergeRequest& request, const MergeResult& result);

}  // namespace dtsdf
