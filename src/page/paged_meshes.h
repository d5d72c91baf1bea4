/// The latest mesh of every block, as a MeshStore has it, for maps of any size: those that changed
/// last in memory, the others in a file.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "dtsdf_mapping/params/map_params.h"
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

/// One thread at a time uses it.
class PagedMeshes {
 public:
  using Stats = PageStats;  ///< Of meshes on disk, since the start or the last clear().

  /// Without map/page_folder all stay in memory; with it, a share of map/max_memory_mb beside it.
  /// @throws std::runtime_error where map/page_folder cannot be written.
  explicit PagedMeshes(const MapParams& params);

  float voxelSize() const { return fetched_.voxelSize(); }

  /// Replaces the mesh of a block; one without triangles removes it. Where the disk fails or is
  /// full, more stay in memory.
  void put(const SharedBlockMesh& block);

  /// Forgets all, of a map whose voxels are of this size from now on.
  void clear(float voxel_size_m);

  /// Of a block, wherever it is; null where there is none. What cannot be read is left out too, and
  /// counted: see stats().
  SharedBlockMesh find(PackedKey key);

  /// A store that has the meshes of these blocks, until this is used again.
  const MeshStore& holding(const std::vector<PackedKey>& keys);
  void dropFetched() { fetched_.clear(); }  ///< That store.

  /// Hands the whole mesh out, piece by piece: what all() would assemble.
  void stream(const MeshStream::Sink& sink);

  /// A store that has them all, until this is used again.
  const MeshStore& all() { return holding(keys()); }

  /// All blocks that have a mesh, by packed key.
  std::vector<PackedKey> keys() const;

  /// Whether some are on disk.
  bool isPaged() const { return stats().bytes > 0; }
  /// Whether some have colours.
  bool isPainted() const { return painted_ > 0; }
  size_t triangleCount() const { return triangles_; }
  uint64_t missed() const { return missed_; }  ///< How often one was asked for and did not come.
  /// Whether the disk gave something when it was asked last: else it may be away.
  bool diskGives() const { return pages_ == nullptr || pages_->diskGives(); }
  size_t bytes() const { return pages_ == nullptr ? bytes_ : pages_->bytes(); }  ///< Of memory.
  size_t mostBytes() const { return most_bytes_; }  ///< That stay in memory; 0: no limit.
  Stats stats() const { return pages_ == nullptr ? Stats() : pages_->stats(); }

 private:
  struct Kept {
    Paged<BlockMesh> mesh;
    size_t bytes, triangles;
    bool is_painted;
  };

  void forget(PackedKey key);

  const size_t most_bytes_;
  const SharedPagedValues pages_;  ///< Null without map/page_folder.
  std::map<PackedKey, Kept> meshes_;
  size_t bytes_ = 0, triangles_ = 0, painted_ = 0;  ///< Of them all.
  uint64_t missed_ = 0;
  MeshStore fetched_;  ///< Of holding().
};

}  // namespace dtsdf
