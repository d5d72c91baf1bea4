/// What the map says of blocks on disk, and what is kept there of blocks of the map.
#pragma once

#include "backend/block_mover.h"
#include "dtsdf_mapping/map_contents.h"
#include "page/page_store.h"

namespace dtsdf {

inline MapBlock mapBlockOf(const PagedBlock& block) {
  return {unpackKey(block.key), block.directions, block.bricks};
}

inline PagedBlock pagedBlockOf(const MapBlock& block, const MeshState& state,
                               uint32_t extractions) {
  return {packKey(block.key),  block.bricks,
          extractions,         static_cast<uint8_t>(block.directions),
          state.has_labels,    state.marks.dirty,
          state.marks.painted, state.has_mesh};
}

inline MeshState meshStateOf(const PagedBlock& block) {
  return {{block.dirty, block.painted}, block.has_mesh, block.has_labels};
}

}  // namespace dtsdf
