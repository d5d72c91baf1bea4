/// The stage "cast" on the CPU: the surfels of a frame into the sums of one block.
#pragma once

#include "cpu/find_blocks.h"

namespace dtsdf {

/// The sums of one block over one frame; one per thread.
struct BlockSums {
  VoxelSums voxel[kDirectionCount][kVoxelsPerBlock];
};

/// Zeroes the sums of some directions, one bit each.
void clearSums(BlockSums& sums, uint32_t directions);

/// Adds those parts of surfels that lie in the block.
void cast(const TouchedBlock& block, const BlockFinder& finder, const FusionSettings& fusion,
          BlockSums& sums);

/// Voxel projection: each voxel takes the pixel that it falls on.
void project(const TouchedBlock& block, const std::vector<Surfel>& surfels, const FrameView& frame,
             const FusionSettings& fusion, BlockSums& sums);

}  // namespace dtsdf
