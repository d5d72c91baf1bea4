/// The stage "clear" on the CPU: voxels of one block that the frame saw as free lose weight.
#pragma once

#include "backend/rules.h"
#include "cpu/voxel_store.h"
#include "kernels/surfels/sensing.h"
#include "map/block_table.h"

namespace dtsdf {

/// `block_L` are the block's coordinates relative to the frame's origin.
void clearFreeSpace(const Vec3i& block_L, const BlockEntry& entry, const FrameSensing& sensing,
                    const Rules& rules, VoxelStore& voxels);

}  // namespace dtsdf
