/// Helpers for map contents: copy the head, compare levelling transforms, and count the words per
/// block.
#pragma once

#include "dtsdf_mapping/map_contents.h"
#include "kernels/core/voxel_colour.h"
#include "map/block_table.h"

namespace dtsdf {

/// Copies everything except blocks, voxels, colours and free cells.
inline MapContents headOf(const MapContents& contents) {
  MapContents head;
  static_cast<MapHead&>(head) = contents;
  return head;
}

/// Whether two maps have the same levelling transform T_W_M, or both have none.
inline bool haveSameLevel(const MapContents& a, const MapContents& b) {
  return a.T_W_M.has_value() == b.T_W_M.has_value() &&
         (!a.T_W_M || a.T_W_M->matrix() == b.T_W_M->matrix());
}

/// Number of words per block in MapContents::voxels and MapContents::colours.
inline size_t voxelWordsOf(const MapBlock& block) {
  return static_cast<size_t>(__builtin_popcount(block.directions)) * kVoxelsPerBlock;
}
inline size_t colourWordsOf(const MapBlock& block) {
  return static_cast<size_t>(__builtin_popcountll(block.bricks)) * kVoxelsPerBrick;
}

}  // namespace dtsdf
