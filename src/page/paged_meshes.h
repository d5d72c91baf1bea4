/// The latest mesh of every block, as a MeshStore has it, for maps of any size: those that changed
/// last in memory, the others in a file.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "dtsdf_mapping/params/map_params.h"
#include "meshing/mesh_stream.h"
#include "page/free_runs.h"
#include "page/page_file.h"

namespace dtsdf {

/// What the mesh of a block takes in memory.
inline size_t bytesOf(const BlockMesh& block) {
  return sizeof(block) + block.vertices.size() * sizeof(BlockVertex) +
         block.triangles.size() * sizeof(uint16_t) + block.colours.size() * sizeof(VertexColour);
}

/// One thread at a time uses it.
class PagedMeshes {
 public:
  using Stats = PagedStats;  ///< Of meshes on disk, since the start or the last clear().

  /// Without map/page_folder all stay in memory; with it, a share of map/max_memory_mb beside it.
  /// @throws std::runtime_error where map/page_folder cannot be written.
  explicit PagedMeshes(const MapParams& params);

  float voxelSize() const { return resident_.voxelSize(); }

  /// Replaces the mesh of a block; one without triangles removes it. Where the disk fails or is
  /// full, more stay in memory.
  void put(const SharedBlockMesh& block);

  /// Forgets all, of a map whose voxels are of this size from now on.
  void clear(float voxel_size_m);

  /// Of a block, wherever it is; null where there is none. What cannot be read is left out too, and
  /// counted: see stats().
  SharedBlockMesh find(PackedKey key);

  /// A store that has the meshes of these blocks at least, until this is used again.
  const MeshStore& holding(const std::vector<PackedKey>& keys);
  void dropFetched() { fetched_.clear(); }  ///< Of that store, what was read.

  /// Hands the whole mesh out, piece by piece: what all() would assemble.
  void stream(const MeshStream::Sink& sink);

  /// A store that has them all, until this is used again.
  const MeshStore& all() { return holding(keys()); }

  /// All blocks that have a mesh, by packed key.
  std::vector<PackedKey> keys() const;

  /// Whether some are on disk.
  bool isPaged() const { return !pages_.empty(); }
  /// Whether some have colours.
  bool isPainted() const { return painted_ > 0; }
  size_t triangleCount() const { return resident_.triangleCount() + paged_triangles_; }
  size_t bytes() const { return bytes_; }           ///< Of memory, without the index.
  size_t mostBytes() const { return most_bytes_; }  ///< That stay in memory; 0: no limit.
  Stats stats() const;

 private:
  struct Page {
    uint64_t checksum;
    uint32_t first_unit;
    uint32_t vertices, indices;
    bool has_colours;
  };

  static size_t recordBytes(const Page& page);
  static uint64_t unitsOf(const Page& page);
  void leaveMemory(PackedKey key);
  void leaveDisk(PackedKey key);
  void makeRoom();
  bool writeOut(const BlockMesh& block);
  SharedBlockMesh read(PackedKey key, const Page& page);
  bool fail(const std::string& problem);

  const uint64_t max_file_bytes_;
  const size_t most_bytes_;
  std::unique_ptr<PageFile> file_;  ///< Null without map/page_folder.
  MeshStore resident_;
  size_t bytes_ = 0;            ///< Of these.
  std::list<PackedKey> order_;  ///< Of these, those that changed longest ago first; with a file.
  std::unordered_map<PackedKey, std::list<PackedKey>::iterator> places_;
  FreeRuns runs_;
  std::map<PackedKey, Page> pages_;
  size_t paged_triangles_ = 0, painted_ = 0;
  MeshStore fetched_;  ///< Of holding().
  Stats stats_;
};

}  // namespace dtsdf
