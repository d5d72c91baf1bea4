/// How a map is handed out and taken in: the order of its voxels and colours.
#pragma once

#include <vector>

#include "backend/mapper_probe.h"
#include "backend/rules.h"
#include "dtsdf_mapping/map_contents.h"
#include "map/block_table.h"

namespace dtsdf {

/// Numbers of voxel arrays and of bricks of colours, in the order of a map's contents, and the
/// slots of their blocks.
struct ContentsOrder {
  std::vector<int32_t> arrays, bricks, slots;
};

/// Calls visit(direction, brick, number) for the bricks of colours of a block.
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

/// Contents with the settings of a mapper, and nothing else yet.
MapContents contentsOf(MapperParams params, Rules rules);

/// What contents say of blocks of a table, in this order; those without voxels are left out: their
/// mesh is all of them.
std::vector<MapBlock> mapBlocks(const BlockTable& table, const std::vector<int32_t>& slots);

/// Where these blocks have their voxels and colours.
ContentsOrder orderOf(const BlockTable& table, const std::vector<int32_t>& slots);

/// Makes room for the voxels and colours of the contents' blocks. @throws std::bad_alloc
void makeRoomForWords(MapContents& contents);

}  // namespace dtsdf
