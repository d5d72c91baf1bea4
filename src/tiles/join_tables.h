/// The tables of all tiles as that of the whole map: which block is where.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "dtsdf_mapping/map_contents.h"
#include "map/block_table.h"
#include "tiles/plan.h"

namespace dtsdf {

/// The tables of all tiles.
struct JoinedTable {
  MapContents head;                 ///< Of the whole map.
  std::vector<uint32_t> tile_of;    ///< By block of the head.
  std::vector<size_t> blocks_of;    ///< Of each tile, how many.
  std::vector<PackedKey> first_of;  ///< Of each tile, its first block.
};

/// Of tiles that are done.
/// @throws std::runtime_error that names a tile which is not sound.
JoinedTable joinTables(const std::string& folder, const LoadedPlan& loaded);

/// @throws std::runtime_error that names the tile, and what makes it anew.
[[noreturn]] void throwBadTile(const std::string& folder, size_t tile, const std::string& why);

}  // namespace dtsdf
