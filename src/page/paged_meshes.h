/// The latest mesh of every block, as a MeshStore has it, for maps of any size: those that changed
/// last in memory, the others in a file.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"
#include "dtsdf_mapping/params/map_params.h"
#include "kernels/core/grid.h"
#include "map/memory_budget.h"
#include "meshing/mesh_stream.h"
#include "page/paged_values.h"

namespace dtsdf {

/// What the mesh of a block takes in memory.
inline size_t bytesOf(const BlockMesh& block) {
  return sizeof(block) + block.vertices.size() * sizeof(BlockVertex) +
         block.triangles.size() * sizeof(uint16_t) + block.colours.size() * sizeof(VertexColour);
}

template <class Io>
void visitRecord(Io& io, BlockMesh& mesh) {
  size_t sizes[] = {mesh.vertices.size(), mesh.triangles.size(), mesh.colours.size()};
  io.array(&mesh.key, 1);
  io.array(sizes, 3);
  io.array(mesh.vertices, sizes[0]);
  io.array(mesh.triangles, sizes[1]);
  io.array(mesh.colours, sizes[2]);
}

/// What stays in memory: a share of the budget, beside it.
constexpr size_t kMeshShare = 8, kMostMeshBytes = size_t{64} << 20;

inline size_t meshBudgetOf(const MapParams& params) {
  if (params.page_folder.empty()) return 0;
  return std::min((static_cast<size_t>(params.max_memory_mb) << 20) / kMeshShare, kMostMeshBytes);
}

/// One thread at a time uses it.
class PagedMeshes {
 public:
  using Stats = PageStats;  ///< Counts for meshes on disk since the start or the last clear().

  /// Without map/page_folder all stay in memory; with it, a share of map/max_memory_mb beside it.
  /// @throws std::runtime_error where map/page_folder cannot be written.
  explicit PagedMeshes(const MapParams& params)
      : most_bytes_(meshBudgetOf(params)),
        pages_(params.page_folder.empty()
                   ? nullptr
                   : std::make_shared<PagedValues>(params.page_folder, pageBytesOf(params),
                                                   most_bytes_)),
        fetched_(params.voxel_size_m) {}

  float voxelSize() const { return fetched_.voxelSize(); }

  /// Replaces the mesh of a block; one without triangles removes it. Where the disk fails or is
  /// full, more stay in memory.
  void put(const SharedBlockMesh& block) {
    const PackedKey key = packedKeyOf(block->key);
    forget(key);
    if (block->triangles.empty()) return;
    const Kept kept{Paged<BlockMesh>(block, pages_), bytesOf(*block), block->triangles.size() / 3,
                    !block->colours.empty()};
    meshes_.emplace(key, kept);
    bytes_ += kept.bytes;
    triangles_ += kept.triangles;
    painted_ += kept.is_painted ? 1 : 0;
  }

  /// Takes over what a mapper's mesh has changed, part by part.
  void update(Mapper& mapper) {
    for (bool is_part = true; is_part;) {
      mapper.beginMeshUpdate();
      MeshUpdate update = mapper.finishMeshUpdate();
      is_part = update.is_part;
      for (BlockMesh& block : update.blocks) {
        put(std::make_shared<const BlockMesh>(std::move(block)));
      }
    }
  }

  /// Forgets all, of a map whose voxels are of this size from now on.
  void clear(float voxel_size_m) {
    fetched_ = MeshStore(voxel_size_m);
    meshes_.clear();
    bytes_ = triangles_ = painted_ = missed_ = 0;
    if (pages_ != nullptr) pages_->resetCounts();
  }

  /// The mesh of a block, wherever it is; null: there is none, or it cannot be read, which missed()
  /// counts.
  SharedBlockMesh find(PackedKey key) {
    const auto found = meshes_.find(key);
    if (found == meshes_.end()) return nullptr;
    SharedBlockMesh mesh = found->second.mesh.get();
    if (mesh == nullptr) ++missed_;
    return mesh;
  }

  /// A store that has the meshes of these blocks, until this is used again.
  const MeshStore& holding(const std::vector<PackedKey>& keys) {
    fetched_.clear();
    for (const PackedKey key : keys) {
      if (SharedBlockMesh block = find(key)) fetched_.put(std::move(block));
    }
    return fetched_;
  }

  void dropFetched() { fetched_.clear(); }  ///< Empties that store.

  /// Hands the whole mesh out, piece by piece: what all() would assemble.
  void stream(const MeshStream::Sink& sink) {
    const std::vector<PackedKey> in_order = keys();
    BlockExtent bounds = noBlocks();
    for (const PackedKey key : in_order) bounds = around(bounds, {unpackKey(key), unpackKey(key)});
    MeshStream stream(voxelSize(), isPainted(), bounds, sink);
    for (const PackedKey key : in_order) {
      if (const SharedBlockMesh block = find(key)) stream.add(*block);
    }
    stream.finish();
  }

  /// A store that has them all, until this is used again.
  const MeshStore& all() { return holding(keys()); }

  /// All blocks that have a mesh, by packed key.
  std::vector<PackedKey> keys() const {
    std::vector<PackedKey> all;
    all.reserve(meshes_.size());
    for (const auto& [key, kept] : meshes_) all.push_back(key);
    return all;
  }

  /// Whether some are on disk.
  bool isPaged() const { return stats().bytes > 0; }
  /// Whether some have colours.
  bool isPainted() const { return painted_ > 0; }
  size_t triangleCount() const { return triangles_; }
  uint64_t missed() const { return missed_; }  ///< How often one was asked for and did not come.
  /// Whether the disk gave something when it was asked last: else it may be away.
  bool diskGives() const { return pages_ == nullptr || pages_->diskGives(); }
  size_t bytes() const { return pages_ == nullptr ? bytes_ : pages_->bytes(); }  ///< In memory.
  size_t mostBytes() const { return most_bytes_; }  ///< What may stay in memory; 0: no limit.
  Stats stats() const { return pages_ == nullptr ? Stats() : pages_->stats(); }

 private:
  struct Kept {
    Paged<BlockMesh> mesh;
    size_t bytes, triangles;
    bool is_painted;
  };

  void forget(PackedKey key) {
    const auto found = meshes_.find(key);
    if (found == meshes_.end()) return;
    bytes_ -= found->second.bytes;
    triangles_ -= found->second.triangles;
    painted_ -= found->second.is_painted ? 1 : 0;
    meshes_.erase(found);
  }

  const size_t most_bytes_;
  const SharedPagedValues pages_;  ///< Null without map/page_folder.
  std::map<PackedKey, Kept> meshes_;
  size_t bytes_ = 0, triangles_ = 0, painted_ = 0;  ///< Totals of all meshes.
  uint64_t missed_ = 0;
  MeshStore fetched_;  ///< What holding() returns.
};

}  // namespace dtsdf
