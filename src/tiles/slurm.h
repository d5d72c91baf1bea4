/// A plan as an array job of Slurm.
#pragma once

#include <string>
#include <vector>

#include "tiles/plan.h"

namespace dtsdf {

struct SlurmRequest {
  std::string folder;   ///< Of the plan.
  std::string program;  ///< The path of `tiles`.
  int threads = 4;      ///< Of each tile.
  std::vector<std::string> options;  ///< For each `tiles fuse`.
};

/// Clusters have limits on the indices of an array; tiles beyond follow in the same tasks.
constexpr size_t kMostArrayIndices = 1000;

/// The script: each task makes every so many-th tile, the longest first.
std::string slurmScript(const SlurmRequest& request, const Plan& plan);

}  // namespace dtsdf
