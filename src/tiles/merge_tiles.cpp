#include "tiles/merge_tiles.h"

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <deque>
#include <functional>
#include <optional>
#include <queue>
#include <stdexcept>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "io/atomic_file.h"
#include "io/block_mesh_file.h"
#include "io/file_hash.h"
#include "io/map_chunks.h"
#include "io/ply_stream.h"
#include "kernels/core/grid.h"
#include "kernels/meshing/refine.h"
#include "map/map_head.h"
#include "meshing/mesh_origin.h"
#include "meshing/mesh_stream.h"
#include "program/stopwatch.h"
#include "tiles/fuse_tile.h"
#include "tiles/join_tables.h"
#include "tiles/tile_folder.h"

namespace dtsdf {
namespace {

/// A tile's meshes, and a bound of where they begin.
struct MeshOfTile {
  size_t tile;
  std::string path;
  uint64_t checksum;   ///< As its record has it.
  PackedKey first;     ///< None of its blocks comes before this one.
  BlockBounds bounds;  ///< Of the blocks that have a mesh.
};

/// What the whole map is.
struct MeshedWhole {
  float voxel_size_m;
  bool painted;
};

bool isOnEdges(const BlockMesh& block) {
  return std::all_of(block.vertices.begin(), block.vertices.end(),
                     [](const BlockVertex& vertex) { return isVertexNumber(vertex.edge); });
}

/// The meshes of a tile, opened when their turn comes.
class TileMeshes {
 public:
  TileMeshes(const MeshOfTile& mesh, const std::string& folder) : mesh_(mesh), folder_(folder) {}

  /// Of the next block; before the file is opened, a bound of it.
  PackedKey key() const { return block_ ? packKey(block_->key) : mesh_.first; }
  bool isOpen() const { return reader_.has_value(); }
  const BlockMesh& block() const { return *block_; }

  /// Opens the file, or moves on in it. @return whether there is another block.
  bool advance() {
    try {
      if (!reader_) reader_.emplace(mesh_.path);
      block_ = reader_->next();
      if (block_ && !isOnEdges(*block_)) {
        throw std::runtime_error("its meshes are damaged (a vertex is on no edge of its block)");
      }
    } catch (const std::exception& error) {
      throwBadTile(folder_, mesh_.tile, error.what());
    }
    if (!block_ && reader_->checksum() != mesh_.checksum) {
      throwBadTile(folder_, mesh_.tile, "its meshes do not match its record");
    }
    return block_.has_value();
  }

 private:
  const MeshOfTile mesh_;
  const std::string folder_;
  std::optional<BlockMeshReader> reader_;
  std::optional<BlockMesh> block_;
};

/// Writes the mesh that a mapper of the whole map would have, vertices and triangles in its order.
/// @throws std::runtime_error that names a damaged tile of the folder
void mergeMeshes(const std::vector<MeshOfTile>& meshes, const std::string& folder,
                 const MeshedWhole& whole, PlyStream& ply) {
  std::deque<TileMeshes> tiles;
  using Turn = std::pair<PackedKey, size_t>;
  std::priority_queue<Turn, std::vector<Turn>, std::greater<Turn>> turns;
  BlockBounds bounds;
  for (const MeshOfTile& mesh : meshes) {
    turns.push({mesh.first, tiles.size()});
    tiles.emplace_back(mesh, folder);
    bounds.add(mesh.bounds);
  }
  MeshStream stream({whole.voxel_size_m, whole.painted, bounds},
                    {[&](const Mesh& piece) { ply.addVertices(piece); },
                     [&](const std::array<uint32_t, 3>& triangle) { ply.addTriangle(triangle); }});
  while (!turns.empty()) {
    TileMeshes& tile = tiles[turns.top().second];
    const size_t number = turns.top().second;
    turns.pop();
    if (tile.isOpen()) stream.add(tile.block());
    if (tile.advance()) turns.push({tile.key(), number});
  }
  stream.finish();
}

/// Tiles side by side are open at once, two files each.
void allowManyFiles() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

/// @throws std::runtime_error with the tiles that are not done.
void checkAllDone(const std::string& folder, const LoadedPlan& loaded) {
  constexpr size_t kMostNamed = 10;
  std::string missing;
  size_t count = 0;
  for (size_t i = 0; i < loaded.plan.tiles.size(); ++i) {
    const std::string why = missingOfTile(folder, i, loaded.id);
    if (why.empty()) continue;
    if (++count <= kMostNamed) {
      missing += (missing.empty() ? "" : "; ") + std::to_string(i) + ": " + why;
    }
  }
  if (count == 0) return;
  throw std::runtime_error(std::to_string(count) + " of " +
                           std::to_string(loaded.plan.tiles.size()) + " tiles are not done (" +
                           missing + (count > kMostNamed ? "; ..." : "") +
                           "); make them with tiles run or tiles fuse DIR TILE");
}

void readWords(const MapChunks& map, size_t chunk, std::vector<uint64_t>& words) {
  map.readVoxels(chunk, words);
}
void readWords(const MapChunks& map, size_t chunk, std::vector<uint32_t>& words) {
  map.readColours(chunk, words);
}

/// The voxels or colours of a tile's map file, from the first block to the last, a chunk in memory.
template <class Word>
class TileWords {
 public:
  TileWords(std::string folder, size_t tile, size_t blocks)
      : folder_(std::move(folder)), tile_(tile), blocks_left_(blocks) {}

  /// Appends those of the next block.
  void append(size_t count, std::vector<Word>& to) {
    try {
      if (!map_) map_.emplace(tilePath(folder_, tile_, ".dtsdf"));
      while (count > 0 && at_ == words_.size()) {  // chunks may have no colours
        readWords(*map_, chunk_++, words_);
        at_ = 0;
      }
    } catch (const std::exception& error) {
      throwBadTile(folder_, tile_, error.what());
    }
    const auto first = words_.begin() + static_cast<std::ptrdiff_t>(at_);
    to.insert(to.end(), first, first + static_cast<std::ptrdiff_t>(count));
    at_ += count;
    if (--blocks_left_ > 0) return;
    map_.reset();
    words_ = std::vector<Word>();
  }

 private:
  const std::string folder_;
  const size_t tile_;
  size_t blocks_left_;
  std::optional<MapChunks> map_;
  std::vector<Word> words_;  ///< Of the chunk before chunk_.
  size_t chunk_ = 0, at_ = 0;
};

/// The voxels or colours of the whole map, by its chunks.
template <class Word>
class JoinedWords {
 public:
  JoinedWords(const JoinedTable& table, const std::string& folder,
              size_t (*words_of)(const MapBlock&))
      : table_(table), words_of_(words_of) {
    for (size_t i = 0; i < table.blocks_of.size(); ++i) {
      tiles_.emplace_back(folder, i, table.blocks_of[i]);
    }
  }

  const Word* join(size_t chunk) {
    const std::vector<MapBlock>& blocks = table_.head.blocks;
    words_.clear();
    const size_t end = std::min(blocks.size(), (chunk + 1) * kBlocksPerMapChunk);
    for (size_t i = chunk * kBlocksPerMapChunk; i < end; ++i) {
      tiles_[table_.tile_of[i]].append(words_of_(blocks[i]), words_);
    }
    return words_.data();
  }

 private:
  const JoinedTable& table_;
  size_t (*const words_of_)(const MapBlock&);
  std::vector<TileWords<Word>> tiles_;
  std::vector<Word> words_;
};

/// @return its content hash.
uint64_t saveJoinedMap(const JoinedTable& table, const MergeRequest& request) {
  JoinedWords<uint64_t> voxels(table, request.folder, voxelWordsOf);
  JoinedWords<uint32_t> colours(table, request.folder, colourWordsOf);
  const MapWords words{[&](size_t chunk) { return voxels.join(chunk); },
                       [&](size_t chunk) { return colours.join(chunk); }};
  return saveMapInChunks(table.head, words, request.map_path, 1).content_hash;
}

void saveJoinedMesh(const JoinedTable& table, const MergeRequest& request,
                    const MapperParams& params, MergeResult& result) {
  std::vector<MeshOfTile> meshes;
  for (size_t i = 0; i < table.blocks_of.size(); ++i) {
    const TileRecord record = loadRecord(request.folder, i);
    meshes.push_back({i, tilePath(request.folder, i, ".mesh"), record.mesh_checksum,
                      table.first_of[i], record.mesh_bounds});
  }
  PlyStream ply(request.mesh_path, params.mesh.colour);
  mergeMeshes(meshes, request.folder, {params.map.voxel_size_m, table.head.painted}, ply);
  ply.finish();
  result.vertices = ply.vertices();
  result.triangles = ply.triangles();
}

}  // namespace

void printMerged(const MergeRequest& request, const MergeResult& result) {
  if (!request.map_path.empty()) {
    std::printf("%zu blocks, content hash %s: %s\n", result.blocks,
                hashDigits(result.content_hash).c_str(), request.map_path.c_str());
  }
  if (!request.mesh_path.empty()) {
    std::printf("%llu vertices, %llu triangles: %s\n",
                static_cast<unsigned long long>(result.vertices),
                static_cast<unsigned long long>(result.triangles), request.mesh_path.c_str());
  }
}

MergeResult mergeTiles(const MergeRequest& request, const LoadedPlan& loaded) {
  const Stopwatch watch;
  const double processor_start_s = processorSeconds();
  for (const std::string& path : {request.mesh_path, request.map_path}) {
    if (!path.empty()) prepareOutputFile(path);
  }
  checkAllDone(request.folder, loaded);
  allowManyFiles();
  const JoinedTable table = joinTables(request.folder, loaded);
  MergeResult result;
  result.blocks = table.head.blocks.size();
  if (!request.map_path.empty()) result.content_hash = saveJoinedMap(table, request);
  if (!request.mesh_path.empty()) {
    const RunSettings settings = settingsOf(loaded.plan);
    saveJoinedMesh(table, request, settings.params.mapper, result);
  }
  result.seconds = watch.seconds();
  result.processor_s = processorSeconds() - processor_start_s;
  return result;
}

}  // namespace dtsdf
