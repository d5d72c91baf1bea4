/// What blocks hold, block by block, as it lies on disk: voxels, colours, labels of units.
#pragma once

#include <vector>

#include "backend/block_mover.h"
#include "dtsdf_mapping/map_contents.h"
#include "page/page_store.h"

namespace dtsdf {

/// Of a record.
inline size_t voxelBytes(const PagedBlock& block) {
  return static_cast<size_t>(__builtin_popcount(block.directions)) * BlockTable::kArrayBytes;
}
inline size_t colourBytes(const PagedBlock& block) {
  return static_cast<size_t>(__builtin_popcountll(block.bricks)) * BlockTable::kColourBytes;
}

inline MapBlock mapBlockOf(const PagedBlock& block) {
  return {unpackKey(block.key), block.directions, block.bricks};
}
PagedBlock pagedBlockOf(const MapBlock& block, const MeshState& state, uint32_t extractions);

/// From contents, which have the voxels of all these blocks first, and from states.
PageBytes recordsOf(const std::vector<PagedBlock>& blocks, const MapContents& contents,
                    const std::vector<MeshState>& states);

/// The way back: into contents, which have room for it. @return what meshing knows of the blocks.
std::vector<MeshState> readRecords(const std::vector<PagedBlock>& blocks, const PageBytes& records,
                                   MapContents& contents);

}  // namespace dtsdf
