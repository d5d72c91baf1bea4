/// The colours of a voxel array, from its bricks; for snapshots.
#pragma once

#include <vector>

#include "map/block_table.h"

namespace dtsdf {

/// One per voxel, or none if the array has no brick. `brick(number)` gives a brick's colours.
template <class Brick>
std::vector<VoxelColour> gatherColours(const BlockTable& table, int32_t array, const Brick& brick) {
  std::vector<VoxelColour> colours;
  for (int voxel = 0; voxel < kVoxelsPerBlock; ++voxel) {
    const int32_t number = table.colourOf(array, brickOf(voxel));
    if (number == kNoArray) continue;
    colours.resize(kVoxelsPerBlock);
    colours[voxel] = brick(number)[placeInBrick(voxel)];
  }
  return colours;
}

}  // namespace dtsdf
