#include "tiles/join_tables.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "io/map_chunks.h"
#include "map/map_head.h"
#include "tiles/tile_folder.h"

namespace dtsdf {
namespace {

/// A block of the whole map, and where it is from.
struct JoinedMapBlock {
  MapBlock block;
  uint32_t tile;
};

void checkSame(const MapContents& a, const MapContents& b) {
  if (a.settings != b.settings || a.map_frame != b.map_frame || a.stamp_s != b.stamp_s ||
      a.frames != b.frames || a.supporting_frames != b.supporting_frames ||
      a.cell_voxels != b.cell_voxels || !sameLevel(a, b) || a.exposure != b.exposure) {
    throw std::runtime_error("its settings or frame counts differ from other tiles'");
  }
}

/// Collects the tables of tiles. These are most of what a merge has in memory: room for all is
/// taken once, as lists that grow would take up to three times as much.
class TableJoiner {
 public:
  TableJoiner(const std::string& folder, const LoadedPlan& loaded)
      : folder_(folder), loaded_(loaded) {
    size_t blocks = 0, cubes = 0;
    for (size_t i = 0; i < loaded.plan.tiles.size(); ++i) {
      records_.push_back(loadRecord(folder, i));
      blocks += records_.back().blocks;
      cubes += records_.back().free_cubes;
    }
    blocks_.reserve(blocks);
    cubes_.reserve(cubes);
  }

  /// Reads a tile's table.
  void add(size_t tile) {
    const MapChunks map(tilePath(folder_, tile, ".dtsdf"));
    const MapContents& head = map.head();
    const TileRecord& record = records_[tile];
    if (map.contentHash() != record.content_hash || head.blocks.size() != record.blocks ||
        head.free_cubes.size() != record.free_cubes) {
      throw std::runtime_error("its map file does not match its record");
    }
    if (tile == 0) table_.head = headOf(head);
    checkSame(table_.head, head);
    table_.head.painted |= head.painted;  // so is the map, once anything of it is
    addBlocks(head, tile);
    addCubes(head, tile);
    table_.blocks_of.push_back(head.blocks.size());
    table_.first_of.push_back(head.blocks.empty() ? 0 : packKey(head.blocks.front().key));
  }

  /// Of all that were added, which have to be all tiles in turn.
  JoinedTable join() {
    std::sort(blocks_.begin(), blocks_.end(), [](const JoinedMapBlock& a, const JoinedMapBlock& b) {
      return packKey(a.block.key) < packKey(b.block.key);
    });
    std::sort(cubes_.begin(), cubes_.end(), [](const MapFreeCube& a, const MapFreeCube& b) {
      return packKey(a.key) < packKey(b.key);
    });
    table_.head.free_cubes = std::move(cubes_);
    table_.head.blocks.reserve(blocks_.size());
    table_.tile_of.reserve(blocks_.size());
    for (const JoinedMapBlock& joined : blocks_) {
      table_.head.blocks.push_back(joined.block);
      table_.tile_of.push_back(joined.tile);
    }
    return std::move(table_);
  }

 private:
  void addBlocks(const MapContents& head, size_t tile) {
    for (const MapBlock& block : head.blocks) {
      if (!loaded_.plan.tiles[tile].own.contains(block.key)) {
        throw std::runtime_error("it contains blocks of other tiles");
      }
      blocks_.push_back({block, static_cast<uint32_t>(tile)});
    }
  }

  void addCubes(const MapContents& head, size_t tile) {
    for (const MapFreeCube& cube : head.free_cubes) {
      if (!cubesOf(loaded_.plan.tiles[tile].own, head.cell_voxels).contains(cube.key)) {
        throw std::runtime_error("it contains free cells of other tiles");
      }
      cubes_.push_back(cube);
    }
  }

  const std::string& folder_;
  const LoadedPlan& loaded_;
  std::vector<TileRecord> records_;
  std::vector<JoinedMapBlock> blocks_;
  std::vector<MapFreeCube> cubes_;
  JoinedTable table_;
};

}  // namespace

JoinedTable joinTables(const std::string& folder, const LoadedPlan& loaded) {
  TableJoiner joiner(folder, loaded);
  for (size_t i = 0; i < loaded.plan.tiles.size(); ++i) {
    try {
      joiner.add(i);
    } catch (const std::exception& error) {
      throwBadTile(folder, i, error.what());
    }
  }
  return joiner.join();
}

void throwBadTile(const std::string& folder, size_t tile, const std::string& why) {
  const std::string number = std::to_string(tile);
  throw std::runtime_error("tile " + number + " cannot be merged: " + why + " (tiles fuse " +
                           folder + " " + number + " --again)");
}

}  // namespace dtsdf
