/// The latest mesh of every block, like MeshStore, but for maps of any size: recently used meshes
/// are kept in memory, the others in a file.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
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

/// Memory of a block's mesh, in bytes.
inline size_t bytesOf(const BlockMesh& block) {
  return sizeof(block) + block.vertices.size() * sizeof(BlockVertex) +
         block.triangles.size() * sizeof(uint16_t) + block.colours.size() * sizeof(VertexColour);
}

/// Whether two block meshes have the same bytes.
inline bool areSame(const BlockMesh& a, const BlockMesh& b) {
  const auto isSame = [](const auto& c, const auto& d) {  // no padding, so memcmp is safe
    return c.size() == d.size() &&
           (c.empty() || std::memcmp(c.data(), d.data(), c.size() * sizeof(c[0])) == 0);
  };
  return isSame(a.vertices, b.vertices) && isSame(a.triangles, b.triangles) &&
         isSame(a.colours, b.colours);
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

/// With map/page_folder, meshes may take up to 1 / kMeshShare of map/max_memory_mb and at most
/// kMaxMeshBytes. This memory comes on top of map/max_memory_mb.
constexpr size_t kMeshShare = 8, kMaxMeshBytes = size_t{64} << 20;

inline size_t meshBudgetOf(const MapParams& params) {
  if (params.page_folder.empty()) return 0;
  return std::min((static_cast<size_t>(params.max_memory_mb) << 20) / kMeshShare, kMaxMeshBytes);
}

/// Meshes of blocks. Not thread-safe.
class PagedMeshes {
 public:
  using Stats = PageStats;  ///< Counters for meshes on disk since the start or the last clear().

  /// Without map/page_folder all meshes stay in memory; with it, up to meshBudgetOf().
  /// @throws std::runtime_error if map/page_folder cannot be written.
  explicit PagedMeshes(const MapParams& params)
      : max_bytes_(meshBudgetOf(params)),
        pages_(params.page_folder.empty()
                   ? nullptr
                   : std::make_shared<PagedValues>(params.page_folder, pageBytesOf(params),
                                                   max_bytes_)),
        voxel_size_m_(params.voxel_size_m) {}

  float voxelSize() const { return voxel_size_m_; }

  /// Replaces the mesh of a block; a mesh without triangles removes it. If the disk fails or is
  /// full, more meshes stay in memory. @return false if the mesh is the same as before; with
  /// map/page_folder, always true unless there is no mesh before and after.
  bool put(const SharedBlockMesh& block) {
    const PackedKey key = packedKeyOf(block->key);
    const auto found = meshes_.find(key);
    if (found == meshes_.end() && block->triangles.empty()) return false;
    if (found != meshes_.end()) {
      if (pages_ == nullptr && areSame(*found->second.mesh.get(), *block)) return false;
      bytes_ -= found->second.bytes;
      triangles_ -= found->second.triangles;
      painted_ -= found->second.is_painted ? 1 : 0;
      meshes_.erase(found);
    }
    if (block->triangles.empty()) return true;
    const Kept kept{Paged<BlockMesh>(block, pages_), bytesOf(*block), block->triangles.size() / 3,
                    !block->colours.empty()};
    meshes_.emplace(key, kept);
    bytes_ += kept.bytes;
    triangles_ += kept.triangles;
    painted_ += kept.is_painted ? 1 : 0;
    return true;
  }

  /// Applies a mapper's mesh update, part by part.
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

  /// Removes all meshes, and sets the voxel size of the map.
  void clear(float voxel_size_m) {
    voxel_size_m_ = voxel_size_m;
    meshes_.clear();
    bytes_ = triangles_ = painted_ = missed_ = 0;
    if (pages_ != nullptr) pages_->resetCounts();
  }

  /// The mesh of a block, from memory or disk. Null if there is none, or if it cannot be read;
  /// missed() counts failed reads.
  SharedBlockMesh find(PackedKey key) {
    const auto found = meshes_.find(key);
    return found == meshes_.end() ? nullptr : meshOf(found->second);
  }

  /// Adds the meshes of these blocks to a store. Blocks without a mesh are skipped.
  /// @param keys Packed keys, in order.
  void addTo(MeshStore& store, const std::vector<PackedKey>& keys) {
    auto it = meshes_.begin();
    for (const PackedKey key : keys) {
      if (it != meshes_.end() && it->first < key) it = meshes_.lower_bound(key);
      if (it == meshes_.end() || it->first != key) continue;
      if (SharedBlockMesh block = meshOf((it++)->second)) store.put(std::move(block));
    }
  }

  MeshStore holding(const std::vector<PackedKey>& keys) {
    MeshStore store(voxel_size_m_);
    addTo(store, keys);
    return store;
  }

  /// Outputs the whole mesh piece by piece: the same mesh as all().assemble().
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

  MeshStore all() { return holding(keys()); }

  /// Packed keys of all blocks that have a mesh, in order.
  std::vector<PackedKey> keys() const {
    std::vector<PackedKey> all;
    all.reserve(meshes_.size());
    for (const auto& [key, kept] : meshes_) all.push_back(key);
    return all;
  }

  /// Whether any mesh is on disk.
  bool isPaged() const { return stats().bytes > 0; }
  bool isPainted() const { return painted_ > 0; }
  size_t triangleCount() const { return triangles_; }
  uint64_t missed() const { return missed_; }  ///< Number of failed reads.
  /// Whether the disk responded to the last read; if not, the disk may have been removed.
  bool diskResponds() const { return pages_ == nullptr || pages_->diskResponds(); }
  size_t bytes() const { return pages_ == nullptr ? bytes_ : pages_->bytes(); }  ///< Used memory.
  size_t maxBytes() const { return max_bytes_; }  ///< Maximum memory; 0 if unlimited.
  Stats stats() const { return pages_ == nullptr ? Stats() : pages_->stats(); }

 private:
  struct Kept {
    Paged<BlockMesh> mesh;
    size_t bytes, triangles;
    bool is_painted;
  };

  SharedBlockMesh meshOf(const Kept& kept) {
    SharedBlockMesh mesh = kept.mesh.get();
    if (mesh == nullptr) ++missed_;
    return mesh;
  }

  const size_t max_bytes_;
  const SharedPagedValues pages_;  ///< Null without map/page_folder.
  std::map<PackedKey, Kept> meshes_;
  size_t bytes_ = 0, triangles_ = 0, painted_ = 0;  ///< Totals of all meshes.
  uint64_t missed_ = 0;
  float voxel_size_m_;
};

}  // namespace dtsdf
