/// Divides map/max_memory_mb between free cells and the rest of the map.
#pragma once

#include <cstddef>

#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// Bytes charged to the budget for a cube that contains free cells: two bits per cell (free,
/// surface), doubled because the vector that stores the cubes may use only half of its capacity.
constexpr size_t kFreeCubeBudgetBytes = 256;

/// Maximum size of a file in map/page_folder, in bytes; 0 if no folder is set.
inline size_t pageBytesOf(const MapParams& params) {
  if (params.page_folder.empty()) return 0;
  return static_cast<size_t>(static_cast<double>(params.page_max_gb) * (size_t{1} << 30));
}

/// With space/enabled, cubes with free cells get an eighth of the budget; blocks, voxels and
/// colours get the rest. The limits are separate, so that free cells do not affect which blocks are
/// refused.
inline size_t freeBudgetOf(const MapperParams& params) {
  constexpr size_t kFreeShare = 8;
  return params.space.enabled ? (static_cast<size_t>(params.map.max_memory_mb) << 20) / kFreeShare
                              : 0;
}
inline size_t mapBudgetOf(const MapperParams& params) {
  return (static_cast<size_t>(params.map.max_memory_mb) << 20) - freeBudgetOf(params);
}

}  // namespace dtsdf
