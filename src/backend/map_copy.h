/// How a map is handed out and taken in: the order of its voxels and colours.
#pragma once

#include <vector>

#include "backend/mapper_probe.h"
#include "backend/rules.h"
#include "dtsdf_mapping/map_contents.h"
#include "map/block_table.h"

namespace dtsdf {

/// Numbers of voxel arrays and of bricks of colours, in the order of a map's contents.
struct ContentsOrder {
  std::vector<int32_t> arrays, bricks;
};

/// Contents with the settings of a mapper, and nothing else yet.
MapContents contentsOf(MapperParams params, Rules rules);

/// What contents say of blocks of a table, in this order; those without voxels are left out: their
/// mesh is all of them.
std::vector<MapBlock> mapBlocks(const BlockTable& table, const std::vector<int32_t>& slots);

/// Where these blocks have their voxels and colours.
ContentsOrder orderOf(const BlockTable& table, const std::vector<int32_t>& slots);

/// Makes room for the voxels and colours of the contents' blocks. @throws std::bad_alloc
void makeRoomForWords(MapContents& contents);

/// Blocks that contents have brought into a table.
struct EnteredBlocks {
  Admission blocks;
  ColourAdmission colours;

  /// Where their voxels and colours go.
  ContentsOrder order() const;
};

/// @pre The table is empty, and its budget is not below the contents' size.
EnteredBlocks enterBlocks(const MapContents& contents, BlockTable& table);

}  // namespace dtsdf
