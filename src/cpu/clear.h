/// The stage "clear" on the CPU: lowers the evidence of voxels that the frame contradicts.
#pragma once

#include "cpu/cast.h"
#include "cpu/voxel_store.h"
#include "kernels/fusion/fusion_rules.h"
#include "kernels/surfels/sensing.h"
#include "map/block_table.h"

namespace dtsdf {

/// How to check a block against a frame.
struct BlockCheck {
  Vec3i block_L;          ///< Block coordinates in the local frame.
  bool in_turn;           ///< Whether to check uncovered voxels, too.
  const BlockSums* sums;  ///< After fold(); null if the frame does not touch the block.
  uint32_t directions;    ///< Bit d: the frame has sums of direction d.
  bool directional;       ///< If false, a single array holds the surfaces of all directions.
};

/// How a block changed.
struct ClearedBlock {
  bool changed;                 ///< Some voxel with a distance lost evidence.
  uint32_t emptied_directions;  ///< Bit d: some voxel of direction d lost its distance.
  uint32_t empty_directions;    ///< Bit d: the array of direction d has become empty.
};

ClearedBlock clearBlock(const BlockCheck& check, const BlockEntry& entry,
                        const FrameSensing& sensing, const FusionRules& rules, VoxelStore& voxels);

}  // namespace dtsdf
