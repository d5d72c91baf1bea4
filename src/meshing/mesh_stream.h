/// Joins the meshes of blocks: vertices that neighbours repeat become one, and get normals; and all
/// of it is handed out piece by piece, as it need not fit into memory.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dtsdf_mapping/block_mesh.h"
#include "dtsdf_mapping/mesh.h"
#include "kernels/meshing/corner_grid.h"
#include "map/block_extent.h"
#include "meshing/outline.h"

namespace dtsdf {

/// The origin of W for what lies within 64 m of it, else the middle, in whole metres: see Mesh.
inline std::array<double, 3> originOf(const BlockExtent& bounds, double voxel_size_m) {
  constexpr double kNear_m = 64.0;  // floats are 0.008 mm apart there
  const double block_m = kBlockSide * voxel_size_m;
  std::array<double, 3> middle_m = {0.0, 0.0, 0.0};
  bool is_near = true;
  for (int axis = 0; axis < 3 && !holdsNone(bounds); ++axis) {
    const double low_m = block_m * component(bounds.first, axis);
    const double high_m = block_m * (component(bounds.last, axis) + 1.0);
    is_near = is_near && low_m >= -kNear_m && high_m <= kNear_m;
    middle_m[static_cast<size_t>(axis)] = std::round(0.5 * (low_m + high_m));
  }
  return is_near ? std::array<double, 3>{0.0, 0.0, 0.0} : middle_m;
}

/// A position in W, as a mesh with this origin has it.
inline Vec3f positionFrom(const std::array<double, 3>& origin_m, const std::array<double, 3>& p_W) {
  return {static_cast<float>(p_W[0] - origin_m[0]), static_cast<float>(p_W[1] - origin_m[1]),
          static_cast<float>(p_W[2] - origin_m[2])};
}

/// What has become of a block's vertices.
struct JoinedBlock {
  std::vector<uint32_t> number;  ///< Per vertex, its number among those of all blocks.
  std::vector<uint32_t> fresh;   ///< Which of them no block before had; numbered in this order.
  std::vector<Vec3f> faced;      ///< The way that each vertex's edge faces, see facedWays().
};

/// Numbers the vertices of blocks, which are added by rising packed keys. Keeps only which vertices
/// later blocks may share, so that a mesh that fills the memory can be joined.
class BlockJoiner {
 public:
  BlockJoiner();

  /// The result is valid until the next call.
  const JoinedBlock& add(const BlockMesh& block);

 private:
  /// An edge that blocks share: its place among those on the lower faces of the block that owns it,
  /// and the number of the vertex on it.
  using SharedEdge = std::pair<uint16_t, uint32_t>;

  /// What a block above one, or this itself, shares with it, while this is added.
  struct Owner {
    std::vector<uint32_t> number;   ///< Indexed by the places of edges; all kNone between blocks.
    std::vector<SharedEdge> known;  ///< What `number` has.
    size_t entered = 0;             ///< So many of them the owner had before.
  };

  uint32_t numberOf(const BlockMesh& block, uint32_t edge);
  uint32_t numberOfEdge(uint32_t edge);
  void open(const BlockKey& block);
  void close(const BlockKey& block);

  uint32_t next_ = 0;  ///< The number of the next vertex that is new.
  JoinedBlock joined_;
  /// Vertices that more than one block may list, by the block that is the last to list them: on
  /// edges, and middles of sides by the numbers of their ends, the lower one in the upper 32 bits.
  std::map<PackedKey, std::vector<SharedEdge>> shared_edges_;
  std::map<PackedKey, std::unordered_map<uint64_t, uint32_t>> shared_sides_;
  std::array<Owner, kCornerBlocks> owners_;  ///< Indexed as cornerBlockOffset().
  /// Vertex numbers of the edges of the block that is being added.
  std::array<uint32_t, kGridEdges> number_of_edge_ = {};
};

/// Adds the normal of a block's triangle, whose corners in the block begin at `corner`, to those of
/// its vertices `t`, by its area. At the rim of what was seen anchoring may fold a triangle: it
/// faces against what its edges face, which no triangle does whose vertices are on their edges. Its
/// normal counts turned round. From positions in the block, which are as good anywhere in the map.
inline void addNormal(const BlockMesh& block, const JoinedBlock& joined, const uint16_t* corner,
                      const std::array<uint32_t, 3>& t, std::vector<Vec3f>& normals) {
  const uint16_t a = corner[0], b = corner[1], c = corner[2];
  const Vec3f& first = block.vertices[a].position;
  const Vec3f n = cross(block.vertices[b].position - first, block.vertices[c].position - first);
  const Vec3f faced = joined.faced[a] + joined.faced[b] + joined.faced[c];
  const float turn = dot(n, faced) < 0.0f ? -1.0f : 1.0f;
  for (const uint32_t v : t) normals[v] = normals[v] + turn * n;
}

/// What a block's vertex is on an outline.
Outline::Kind outlineKind(const BlockVertex& vertex);

/// Makes sums of normals unit normals; up where they are 0.
void makeUnit(std::vector<Vec3f>& normals);

/// Takes blocks by rising keys, and keeps only the vertices that later blocks may share or have
/// outlines through. What it hands out is what MeshStore::assemble() returns of all of them, in the
/// same order.
class MeshStream {
 public:
  /// Whoever takes the mesh.
  struct Sink {
    std::function<void(const Mesh& piece)> vertices;  ///< Takes the next vertices; no triangles.
    /// Takes numbers of vertices in the whole mesh; some come before their vertices do.
    std::function<void(const std::array<uint32_t, 3>&)> triangle;
  };

  /// @param is_painted Some of the blocks have colours.
  /// @param bounds Bounds of the blocks.
  MeshStream(float voxel_size_m, bool is_painted, const BlockExtent& bounds, Sink sink);

  void add(const BlockMesh& block);

  /// Hands out what is left.
  void finish();

 private:
  struct AddedBlock {
    BlockKey key;
    uint64_t end;  ///< Vertices of all blocks up to this one.
  };

  uint64_t end() const { return first_ + window_.vertices_m.size(); }
  std::array<uint32_t, 3> inWindow(const std::array<uint32_t, 3>& triangle) const;
  void addVertex(const BlockMesh& block, size_t i);
  void write(uint64_t end_number);
  void forget(uint64_t end_number);

  const MeshStore positions_;
  const bool is_painted_;
  const Sink sink_;
  BlockJoiner joiner_;
  Mesh window_;                             ///< From vertex number first_ on.
  Outline outline_;                         ///< Outlines through these vertices.
  std::vector<Outline::Triangle> closing_;  ///< Triangles that close holes; they come last.
  uint64_t first_ = 0, written_ = 0;
  std::deque<AddedBlock> open_;    ///< Triangles of blocks to come may have vertices of these.
  std::deque<AddedBlock> needed_;  ///< Outlines through blocks to come may lead to these.
  uint64_t closed_ = 0;            ///< Vertices before those of open_.
};

}  // namespace dtsdf
