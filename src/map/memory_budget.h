/// What map/max_memory_mb is shared out to.
#pragma once

#include <cstddef>

#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// Bytes that a cube of cells counts of which some are free: its bits, and the index at its
/// emptiest.
constexpr size_t kFreeCubeBudgetBytes = 256;

/// Each part has its own limit, so that what is refused of one follows from the frames alone, and
/// not from what the other one holds at the time.
struct MemoryBudget {
  size_t map_bytes;   ///< Blocks, voxels and colours.
  size_t free_bytes;  ///< Cubes of which something is seen free.
};

/// What may lie on disk beside it.
inline size_t pageBytesOf(const MapParams& params) {
  if (params.page_folder.empty()) return 0;
  return static_cast<size_t>(static_cast<double>(params.page_max_gb) * (size_t{1} << 30));
}

/// With space/enabled an eighth is for what is free.
inline MemoryBudget budgetOf(const MapperParams& params) {
  constexpr size_t kFreeShare = 8;
  const size_t all = static_cast<size_t>(params.map.max_memory_mb) << 20;
  const size_t free_bytes = params.space.enabled ? all / kFreeShare : 0;
  return {all - free_bytes, free_bytes};
}

}  // namespace dtsdf
