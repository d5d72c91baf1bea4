/// A triangle mesh with shared vertices, and the store that collects mesh updates by blocks.
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

/// Triangle mesh in the map frame W, in metres. Canonical: equal maps give equal bytes.
///
/// Floats are too coarse far from the origin of W: 4 mm apart at 40 km. So if a mesh reaches beyond
/// 64 m, its vertices are relative to an origin of its own, near its centre.
struct Mesh {
  std::array<double, 3> origin_m = {0.0, 0.0, 0.0};  ///< In W, in whole metres; mostly that of W.
  std::vector<Vec3f> vertices_m;                     ///< Positions in W, less `origin_m`.
  std::vector<Vec3f> normals;                      ///< Unit, per vertex, pointing to the free side.
  std::vector<std::array<uint32_t, 3>> triangles;  ///< Counter-clockwise seen from the free side.
  std::vector<VertexColour> colours;               ///< Per vertex; none if no block has colours.
};

/// Position of a vertex in W, in metres.
inline std::array<double, 3> positionInMap(const Mesh& mesh, size_t vertex) {
  const Vec3f& p = mesh.vertices_m[vertex];
  return {mesh.origin_m[0] + static_cast<double>(p.x), mesh.origin_m[1] + static_cast<double>(p.y),
          mesh.origin_m[2] + static_cast<double>(p.z)};
}

/// Whether the vertices are relative to another origin than that of W.
inline bool isFarFromOrigin(const Mesh& mesh) {
  return mesh.origin_m != std::array<double, 3>{0.0, 0.0, 0.0};
}

/// A block's mesh, shared by whoever shows, keeps or saves it; it never changes once it is made.
using SharedBlockMesh = std::shared_ptr<const BlockMesh>;

/// The latest mesh of every block. Pass it each MeshUpdate of a mapper, in order. Copies share the
/// meshes, so they are cheap.
class MeshStore {
 public:
  /// A store without blocks, for a mapper with voxels of this size.
  explicit MeshStore(float voxel_size_m);

  /// Applies an update.
  void apply(const MeshUpdate& update);

  /// Replaces the mesh of one block without copying it; one without triangles removes the block.
  void put(SharedBlockMesh block);

  /// Removes all blocks; call it together with Mapper::clear().
  void clear();

  /// The blocks' meshes in canonical order (by packed key); none of them is empty.
  const std::map<PackedKey, SharedBlockMesh>& blocks() const { return blocks_; }

  /// Edge of a voxel in metres.
  float voxelSize() const { return voxel_size_m_; }

  /// Triangles of all blocks.
  size_t triangleCount() const { return triangle_count_; }

  /// Position of a block's vertex in W, in metres.
  std::array<double, 3> positionInMap(const BlockKey& key, const BlockVertex& vertex) const;

  /// Joins all blocks into one mesh: vertices that neighbouring blocks share appear once. Where the
  /// mesh ends, its outline is smoothed.
  Mesh assemble() const;

  /// The triangles of assemble() whose corners all lie in a box, with the normals that they have
  /// there. @pre findProblem(region) is empty.
  Mesh assemble(const BoxRegion& region) const;

 private:
  Mesh join(const std::vector<const BlockMesh*>& blocks) const;  ///< In order of their keys.

  float voxel_size_m_;
  std::map<PackedKey, SharedBlockMesh> blocks_;
  size_t triangle_count_ = 0;
};

/// A block's key in a store: the key of its mesh, packed.
PackedKey packedKeyOf(const BlockKey& key);

/// 8-bit RGB colour of one of a mesh's vertices.
std::array<uint8_t, 3> vertexColour(MeshColour mode, const Mesh& mesh, size_t vertex);

}  // namespace dtsdf
