/// The folder of a plan: what lies where, which tiles are done, and who works on which.
///
///   plan.json plan.txt plan.svg   the plan, as a table, as a picture
///   tiles/0007.dtsdf 0007.mesh    a tile's own blocks, and their meshes
///   tiles/0007.json               written last: the tile is done
///   tiles/0007.failed             why the last attempt failed
///   tiles/0007.lock               locked while somebody works on it
///   tiles/0007.log                what the attempts of `tiles run` have said
///   tiles/slurm-JOB_TASK.log      what a task of the job of `tiles slurm` has said
#pragma once

#include <cstdint>
#include <string>

#include "meshing/mesh_origin.h"
#include "tiles/plan.h"

namespace dtsdf {

std::string planPath(const std::string& folder);

/// The path of one of a tile's files, as for ".dtsdf".
std::string tilePath(const std::string& folder, size_t tile, const std::string& ending);

/// Makes the folder in which the files of tiles lie.
/// @throws std::runtime_error that says what to do.
void prepareTiles(const std::string& folder);

/// What a tile's process has made.
struct TileRecord {
  std::string plan_id;
  uint64_t content_hash = 0;   ///< Of its map file.
  uint64_t mesh_checksum = 0;  ///< Of its meshes.
  BlockBounds mesh_bounds;     ///< Of the blocks that have one.
  uint64_t map_file_bytes = 0, mesh_file_bytes = 0;
  size_t blocks = 0, voxel_arrays = 0, free_cubes = 0, triangles = 0;
  size_t frames = 0;      ///< That were fused into it.
  size_t images = 0;      ///< Of colour, that it was painted with.
  size_t map_bytes = 0;   ///< Of the map, halo included, at the end.
  size_t peak_bytes = 0;  ///< Of the process, at most.
  double seconds = 0.0;
  double processor_s = 0.0;  ///< Of all threads.
  std::string backend;
};

void saveRecord(const TileRecord& record, const std::string& folder, size_t tile);

/// @throws std::runtime_error for one that is not there or cannot be read.
TileRecord loadRecord(const std::string& folder, size_t tile);

enum class TileStage { kWaiting, kRunning, kFailed, kDone };

struct TileState {
  TileStage stage = TileStage::kWaiting;
  std::string why;  ///< It is not done, or failed.
};

/// By the record and the sizes of the files; their content is checked when they are merged.
TileState stateOf(const std::string& folder, size_t tile, const std::string& plan_id);

/// What is missing of a tile that should be done; empty if nothing is.
std::string missingOfTile(const std::string& folder, size_t tile, const std::string& plan_id);

/// Forgets what was made of a tile.
void forgetTile(const std::string& folder, size_t tile);

/// Held while a tile is worked on; it ends with its process, whatever ends that.
class TileLock {
 public:
  /// @throws std::runtime_error if somebody else holds it, or nobody can.
  TileLock(const std::string& folder, size_t tile);
  ~TileLock();
  TileLock(const TileLock&) = delete;
  TileLock& operator=(const TileLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace dtsdf
