/// A triangle mesh with shared vertices, and the store that collects the mesh updates of all
/// blocks.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "dtsdf_mapping/block_mesh.h"
#include "dtsdf_mapping/params/mesh_params.h"
#include "dtsdf_mapping/region.h"

namespace dtsdf {

/// Triangle mesh in the map frame W, in metres, in canonical order: equal maps give equal bytes.
///
/// Floats are too coarse far from the origin of W: 4 mm apart at 40 km. A mesh that extends beyond
/// 64 m therefore has its own origin near its centre, and its vertices are relative to that origin.
struct Mesh {
  std::array<double, 3> origin_m = {0.0, 0.0, 0.0};  ///< Origin in W, in whole metres; usually 0.
  std::vector<Vec3f> vertices_m;                     ///< Positions in W minus `origin_m`.
  std::vector<Vec3f> normals;  ///< Unit normals per vertex, pointing to the free side.
  /// Counter-clockwise as viewed from the free side.
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<VertexColour> colours;  ///< Per vertex; empty if no block has colours.
};

/// Position of a vertex in W, in metres.
inline std::array<double, 3> positionInMap(const Mesh& mesh, size_t vertex) {
  const Vec3f& p = mesh.vertices_m[vertex];
  return {mesh.origin_m[0] + static_cast<double>(p.x), mesh.origin_m[1] + static_cast<double>(p.y),
          mesh.origin_m[2] + static_cast<double>(p.z)};
}

/// Whether the mesh has its own origin.
inline bool isFarFromOrigin(const Mesh& mesh) {
  return mesh.origin_m != std::array<double, 3>{0.0, 0.0, 0.0};
}

/// The mesh of a block, immutable and shared by the code that publishes, stores or saves it.
using SharedBlockMesh = std::shared_ptr<const BlockMesh>;

/// The latest mesh of every block. Apply every MeshUpdate of a mapper, in order. Copies are cheap,
/// since they share the block meshes.
class MeshStore {
 public:
  /// Creates an empty store for a mapper with this voxel size.
  explicit MeshStore(float voxel_size_m);

  /// Applies an update.
  void apply(const MeshUpdate& update);

  /// Replaces the mesh of one block without copying it. A mesh without triangles removes the block.
  void put(SharedBlockMesh block);

  /// Removes all blocks; call it together with Mapper::clear().
  void clear();

  /// The block meshes in canonical order (by packed key), none of them empty.
  const std::map<PackedKey, SharedBlockMesh>& blocks() const { return blocks_; }

  /// Edge of a voxel in metres.
  float voxelSize() const { return voxel_size_m_; }

  /// Number of triangles in all blocks.
  size_t triangleCount() const { return triangle_count_; }

  /// Position in W of a vertex of a block, in metres.
  std::array<double, 3> positionInMap(const BlockKey& key, const BlockVertex& vertex) const;

  /// Joins all blocks into one mesh, in which vertices shared by neighbouring blocks appear once.
  /// Small pieces are left out, small holes and gaps are closed, and borders are smoothed.
  Mesh assemble() const;

  /// The triangles of assemble() whose corners all lie in a box, with their normals unchanged.
  /// @pre findProblem(region) is empty.
  Mesh assemble(const BoxRegion& region) const;

 private:
  Mesh join(const std::vector<const BlockMesh*>& blocks) const;  ///< @pre Blocks sorted by key.

  float voxel_size_m_;
  std::map<PackedKey, SharedBlockMesh> blocks_;
  size_t triangle_count_ = 0;
};

/// Packs a block key, as in MeshStore::blocks().
PackedKey packedKeyOf(const BlockKey& key);

/// RGB colour of a vertex in the given mode.
std::array<uint8_t, 3> vertexColour(MeshColour mode, const Mesh& mesh, size_t vertex);

}  // namespace dtsdf
