/// Helpers for copying a map to and from MapContents.
#pragma once

#include <vector>

#include "backend/mapper_probe.h"
#include "backend/rules.h"
#include "dtsdf_mapping/map_contents.h"
#include "map/block_table.h"

namespace dtsdf {

/// Indices of voxel arrays and colour bricks, and slots of blocks, in the order of a map's
/// contents.
struct ContentsOrder {
  std::vector<int32_t> arrays, bricks, slots;
};

/// Calls visit(direction, brick, index) for each colour brick of a block.
template <class Visit>
void visitBricks(const BlockTable& table, const BlockEntry& entry, const Visit& visit) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    for (int b = 0; b < kBricksPerArray; ++b) {
      const int32_t number = table.colourOf(entry.array[d], b);
      if (number != kNoArray) visit(d, b, number);
    }
  }
}

/// Contents that consist only of the settings of a mapper.
MapContents contentsOf(MapperParams params, Rules rules);

/// Converts blocks of a table to the format of MapContents, in the order of `slots`. Leaves out
/// blocks without voxel arrays, which stay in the table only until their empty meshes are reported.
std::vector<MapBlock> mapBlocks(const BlockTable& table, const std::vector<int32_t>& slots);

/// Finds the indices of the voxels and colours of the blocks in `slots`.
ContentsOrder orderOf(const BlockTable& table, const std::vector<int32_t>& slots);

/// Allocates voxels and colours for all blocks of the contents. @throws std::bad_alloc
void allocateWords(MapContents& contents);

}  // namespace dtsdf
