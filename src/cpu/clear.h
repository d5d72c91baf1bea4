/// The stage "clear" on the CPU: what the frame contradicts loses evidence.
#pragma once

#include "cpu/cast.h"
#include "cpu/voxel_store.h"
#include "kernels/fusion/fusion_rules.h"
#include "kernels/surfels/sensing.h"
#include "map/block_table.h"

namespace dtsdf {

/// A frame's look at a block.
struct BlockLook {
  Vec3i block_L;          ///< Its coordinates relative to the frame's origin.
  bool in_turn;           ///< It is the block's turn.
  const BlockSums* sums;  ///< The frame's, folded; null if it does not touch the block.
  uint32_t directions;    ///< Bit d: the frame has sums of direction d.
  bool directional;       ///< Else the only array holds surfaces of any direction.
};

/// What became of a block.
struct ClearedBlock {
  bool changed;                 ///< Some voxel with a distance lost evidence.
  uint32_t emptied_directions;  ///< Bit d: some voxel of direction d lost its distance.
  uint32_t empty_directions;    ///< Bit d: the whole array is empty.
};

ClearedBlock clearBlock(const BlockLook& look, const BlockEntry& entry, const FrameSensing& sensing,
                        const FusionRules& rules, VoxelStore& voxels);

}  // namespace dtsdf
