/// The stage "fold" on the CPU: the sums of one block into its voxels.
#pragma once

#include "cpu/cast.h"
#include "cpu/voxel_store.h"

namespace dtsdf {

/// Folds the sums of those directions (one bit each) that the block has an array of, and zeroes the
/// sums of all of them.
/// @return those of them whose arrays hold nothing.
uint32_t fold(BlockSums& sums, uint32_t directions, const BlockEntry& entry, float depth_weight,
              const FusionSettings& fusion, VoxelStore& voxels);

}  // namespace dtsdf
