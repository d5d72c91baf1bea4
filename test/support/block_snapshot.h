/// Copies of the voxels and colours in a map, per block.
#pragma once

#include <cstring>
#include <utility>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "map/block_table.h"

namespace dtsdf {

/// A copy of the voxels and colours in a block.
struct BlockSnapshot {
  BlockKey key;
  /// For each direction, kVoxelsPerBlock voxels, or none if the block has none there.
  std::vector<Voxel> voxels[kDirectionCount];
  /// For each direction, kVoxelsPerBlock colours, or none if the block has none there.
  std::vector<VoxelColour> colours[kDirectionCount];
};

/// All blocks, sorted by packed key.
inline std::vector<BlockSnapshot> snapshotOf(Mapper& mapper) {
  const MapContents contents = mapper.contents();
  std::vector<BlockSnapshot> blocks;
  const uint64_t* voxels = contents.voxels.data();
  const uint32_t* colours = contents.colours.data();
  for (const MapBlock& block : contents.blocks) {
    BlockSnapshot copy;
    copy.key = block.key;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (!(block.directions >> d & 1)) continue;
      copy.voxels[d].resize(kVoxelsPerBlock);
      std::memcpy(copy.voxels[d].data(), voxels, BlockTable::kArrayBytes);
      voxels += kVoxelsPerBlock;
      for (int brick = 0; brick < kBricksPerArray; ++brick) {
        if (!(block.bricks >> (kBricksPerArray * d + brick) & 1)) continue;
        copy.colours[d].resize(kVoxelsPerBlock);
        for (int place = 0; place < kVoxelsPerBrick; ++place) {
          std::memcpy(&copy.colours[d][voxelInBrick(brick, place)], colours++, sizeof(VoxelColour));
        }
      }
    }
    blocks.push_back(std::move(copy));
  }
  return blocks;
}

}  // namespace dtsdf
