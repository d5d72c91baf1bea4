/// What map/max_memory_mb is shared out to.
#pragma once

#include <cstddef>

#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// Bytes that a cube of cells counts of which some are free: its bits, and the index at its
/// emptiest.
constexpr size_t kFreeCubeBudgetBytes = 256;

/// What may lie on disk beside it.
inline size_t pageBytesOf(const MapParams& params) {
  if (params.page_folder.empty()) return 0;
  return static_cast<size_t>(static_cast<double>(params.page_max_gb) * (size_t{1} << 30));
}

/// Cubes of which something is seen free have an eighth with space/enabled, and blocks, voxels and
/// colours the rest: each has its own limit, so that what is refused of one follows from the frames
/// alone, and not from what the other one holds at the time.
inline size_t freeBudgetOf(const MapperParams& params) {
  constexpr size_t kFreeShare = 8;
  return params.space.enabled ? (static_cast<size_t>(params.map.max_memory_mb) << 20) / kFreeShare
                              : 0;
}
inline size_t mapBudgetOf(const MapperParams& params) {
  return (static_cast<size_t>(params.map.max_memory_mb) << 20) - freeBudgetOf(params);
}

}  // namespace dtsdf
