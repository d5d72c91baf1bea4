/// What a map's contents hold besides blocks, voxels, colours and free cells.
#pragma once

#include "dtsdf_mapping/map_contents.h"
#include "kernels/core/voxel_colour.h"
#include "map/block_table.h"

namespace dtsdf {

/// A copy of the contents without blocks, voxels, colours and free cells.
inline MapContents headOf(const MapContents& contents) {
  MapContents head;
  static_cast<MapHead&>(head) = contents;
  return head;
}

/// Whether two maps lie alike in the frame of their poses.
inline bool sameLevel(const MapContents& a, const MapContents& b) {
  return a.T_W_M.has_value() == b.T_W_M.has_value() &&
         (!a.T_W_M || a.T_W_M->matrix() == b.T_W_M->matrix());
}

/// Words that a block has among those of the contents.
inline size_t voxelWordsOf(const MapBlock& block) {
  return static_cast<size_t>(__builtin_popcount(block.directions)) * kVoxelsPerBlock;
}
inline size_t colourWordsOf(const MapBlock& block) {
  return static_cast<size_t>(__builtin_popcountll(block.bricks)) * kVoxelsPerBrick;
}

}  // namespace dtsdf
