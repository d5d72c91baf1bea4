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

/// Lists a table's blocks in the contents and makes room for what they hold.
/// @return where that is. @throws std::bad_alloc
ContentsOrder listBlocks(const BlockTable& table, MapContents& contents);

/// The same of some blocks, in this order; those without voxels are left out.
ContentsOrder listBlocks(const BlockTable& table, const std::vector<int32_t>& slots,
                         MapContents& contents);

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
