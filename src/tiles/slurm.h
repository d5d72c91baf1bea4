/// A plan as an array job of Slurm.
#pragma once

#include <optional>
#include <string>

#include "tiles/plan.h"

namespace dtsdf {

struct SlurmRequest {
  std::string folder;                  ///< Of the plan.
  std::string program;                 ///< The path of `tiles`.
  int threads = 4;                     ///< Of each tile.
  std::optional<std::string> backend;  ///< With cuda each task asks for a GPU.
};

/// Clusters have limits on the indices of an array; tiles beyond follow in the same tasks.
constexpr size_t kMostArrayIndices = 1000;

/// The script: each task makes every so many-th tile, the longest first. Slurm writes its logs
/// beside the tiles, in a folder that has to be there (prepareTiles()).
/// @throws std::runtime_error for a folder whose name Slurm cannot be given.
std::string slurmScript(const SlurmRequest& request, const Plan& plan);

}  // namespace dtsdf
