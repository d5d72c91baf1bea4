#include "tiles/merge_tiles.h"

#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <stdexcept>

#include "dtsdf_mapping/io/map_file.h"
#include "io/atomic_file.h"
#include "io/file_hash.h"
#include "io/map_chunks.h"
#include "io/ply_stream.h"
#include "map/map_head.h"
#include "program/stopwatch.h"
#include "tiles/fuse_tile.h"
#include "tiles/join_tables.h"
#include "tiles/merge_mesh.h"
#include "tiles/tile_folder.h"

namespace dtsdf {
namespace {

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
