/// Makes one tile of a plan.
#pragma once

#include <optional>
#include <string>

#include "tiles/plan.h"

namespace dtsdf {

/// In place of built-in defaults.
struct FuseOptions {
  std::optional<std::string> backend;
  std::optional<int> threads;
};

struct FuseRequest {
  std::string folder;  ///< Of the plan.
  size_t tile = 0;
  FuseOptions options;
  bool again = false;  ///< Also if it is done.
};

/// Fuses the tile's frames and saves its map and meshes; does nothing if that was done. What is
/// there is whole at any time, and a tile counts as done once all of it is.
/// @throws std::runtime_error that says why the tile cannot be made; also in the tile's .failed.
void fuseTile(const FuseRequest& request, const LoadedPlan& plan);

/// The settings of a plan with what a program adds.
RunSettings settingsOf(const Plan& plan, const FuseOptions& options = {});

}  // namespace dtsdf
