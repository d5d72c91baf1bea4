/// Joins the meshes of blocks: merges the vertices that neighbouring blocks share, and computes
/// vertex normals. A mesh that does not fit in memory can be output in pieces.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <utility>
#include <vector>

#include "dtsdf_mapping/block_mesh.h"
#include "dtsdf_mapping/mesh.h"
#include "kernels/core/grid.h"
#include "kernels/meshing/corner_grid.h"
#include "map/block_extent.h"
#include "meshing/mend.h"

namespace dtsdf {

/// Mesh::origin_m of a mesh with these bounds: the origin of W if they lie within 64 m of it,
/// otherwise their centre, rounded to whole metres.
inline std::array<double, 3> originOf(const BlockExtent& bounds, double voxel_size_m) {
  constexpr double kNear_m = 64.0;  // floats are 0.008 mm apart at this distance
  const double block_m = kBlockSide * voxel_size_m;
  std::array<double, 3> middle_m = {0.0, 0.0, 0.0};
  bool is_near = true;
  for (int axis = 0; axis < 3 && !holdsNothing(bounds); ++axis) {
    const double low_m = block_m * component(bounds.first, axis);
    const double high_m = block_m * (component(bounds.last, axis) + 1.0);
    is_near = is_near && low_m >= -kNear_m && high_m <= kNear_m;
    middle_m[static_cast<size_t>(axis)] = std::round(0.5 * (low_m + high_m));
  }
  return is_near ? std::array<double, 3>{0.0, 0.0, 0.0} : middle_m;
}

/// Converts a position in W to one relative to a mesh's origin.
inline Vec3f positionFrom(const std::array<double, 3>& origin_m, const std::array<double, 3>& p_W) {
  return {static_cast<float>(p_W[0] - origin_m[0]), static_cast<float>(p_W[1] - origin_m[1]),
          static_cast<float>(p_W[2] - origin_m[2])};
}

/// A block's vertices in the joined mesh.
struct JoinedBlock {
  std::vector<uint32_t> number;  ///< Index of each vertex in the joined mesh.
  std::vector<uint32_t> fresh;   ///< Indices of the vertices that are in no earlier block.
  std::vector<Vec3f> faced;      ///< Facing of each vertex's edge (see facingSteps()).
};

/// A hash table with open addressing that maps names to numbers.
class NumberTable {
 public:
  /// Returns the number of a name. A new name is added with `number`.
  uint32_t findOrAdd(uint64_t name, uint32_t number) {
    if (2 * used_ >= slots_.size()) grow();
    Slot& slot = slotOf(name);
    if (slot.second == kNone) slot = {name, number}, ++used_;
    return slot.second;
  }

  void clear() {
    if (used_ > 0) slots_.assign(slots_.size(), {0, kNone});
    used_ = 0;
  }

 private:
  using Slot = std::pair<uint64_t, uint32_t>;
  static constexpr uint32_t kNone = UINT32_MAX;

  Slot& slotOf(uint64_t name) {
    const size_t last = slots_.size() - 1;
    size_t at = static_cast<size_t>(hashKey(name)) & last;
    while (slots_[at].second != kNone && slots_[at].first != name) at = (at + 1) & last;
    return slots_[at];
  }

  void grow() {
    std::vector<Slot> old(std::max<size_t>(64, 2 * slots_.size()), {0, kNone});
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.second != kNone) slotOf(slot.first) = slot;
    }
  }

  std::vector<Slot> slots_;  ///< The number of slots is a power of two, or 0.
  size_t used_ = 0;
};

/// Assigns indices to the vertices of blocks, which must be added in order of their packed keys. To
/// save memory, keeps only the vertices that subsequent blocks may share.
class BlockJoiner {
 public:
  /// Adds a block. The result is valid until the next call.
  const JoinedBlock& add(const BlockMesh& block);

 private:
  uint32_t numberOf(uint32_t edge);

  uint32_t next_ = 0;  ///< Index of the next new vertex.
  JoinedBlock joined_;
  BlockKey last_{0, INT32_MIN, INT32_MIN};  ///< The block added last.
  /// Vertices that may occur again: midpoints inside the current block (inside_), and vertices
  /// shared with other blocks in this or the next row or layer.
  NumberTable inside_;
  std::array<NumberTable, 2> rows_, layers_;
  std::array<PackedKey, kCornerBlocks> owners_ = {};      ///< See cornerBlockOffset().
  std::array<uint32_t, kGridEdges> number_of_edge_ = {};  ///< For the block being added.
};

/// Adds the area-weighted normal of a block's triangle to the normals of its vertices. At the rim
/// of the measured surface, anchoring (kernels/meshing/anchoring.h) may fold a triangle over. The
/// triangle's normal then points against the facings of its edges, and is reversed. Positions are
/// relative to the block, so the normal is equally accurate anywhere in the map.
/// @param corner Points to the triangle's three indices in the block.
/// @param t The same vertices in the joined mesh.
inline void addNormal(const BlockMesh& block, const JoinedBlock& joined, const uint16_t* corner,
                      const std::array<uint32_t, 3>& t, std::vector<Vec3f>& normals) {
  const uint16_t a = corner[0], b = corner[1], c = corner[2];
  const Vec3f& first = block.vertices[a].position;
  const Vec3f n = cross(block.vertices[b].position - first, block.vertices[c].position - first);
  const Vec3f faced = joined.faced[a] + joined.faced[b] + joined.faced[c];
  const float turn = dot(n, faced) < 0.0f ? -1.0f : 1.0f;
  for (const uint32_t v : t) normals[v] = normals[v] + turn * n;
}

/// The kind of a block's vertex for an Outline.
Outline::Kind outlineKind(const BlockVertex& vertex);

/// Normalises sums of normals; a sum of 0 becomes (0, 0, 1).
void makeUnit(std::vector<Vec3f>& normals);

/// Joins blocks that are added in order of their packed keys. Keeps only vertices that subsequent
/// blocks may share, or whose outlines subsequent blocks may change. Outputs the same vertices and
/// triangles as MeshStore::assemble(), in the same order.
class MeshStream {
 public:
  struct Sink {
    std::function<void(const Mesh& piece)> vertices;  ///< Receives the next vertices.
    /// Receives the vertex indices of a triangle, after its vertices have been output.
    std::function<void(const std::array<uint32_t, 3>&)> triangle;
  };

  /// @param is_painted Whether any of the blocks has colours.
  /// @param bounds Bounds of the blocks.
  /// @param vertices_at_once Vertices are output and dropped in batches of at least this many, and
  /// of at least a quarter of the vertices in memory.
  MeshStream(float voxel_size_m, bool is_painted, const BlockExtent& bounds, Sink sink,
             uint32_t vertices_at_once = 65536);

  void add(const BlockMesh& block);

  /// Outputs the rest. Call this after the last block.
  void finish();

 private:
  /// The processing steps: link, remove crumbs, close holes (see meshing/mend.h), write and forget.
  static constexpr size_t kSteps = 5;
  /// A step processes a block's vertices once all blocks up to this many blocks farther along each
  /// axis have been added (first step) or processed by the previous step. Neighbouring blocks may
  /// list the same vertices, and each step depends on the results of the previous step up to one or
  /// two blocks away. Triangles that fill holes may have to wait two more blocks until all their
  /// vertices are written.
  static constexpr std::array<int32_t, kSteps> kBlocksBehind = {1, 2, 2, 1, 2};

  /// A block, and the number of vertices up to and including this block.
  using AddedBlock = std::pair<BlockKey, uint32_t>;
  using Triangles = std::vector<Outline::Triangle>;

  uint32_t end() const { return first_ + static_cast<uint32_t>(window_.vertices_m.size()); }
  void addVertex(const BlockMesh& block, size_t i);
  void process(const std::array<uint32_t, kSteps>& ends);
  void write(uint32_t begin, uint32_t end);
  void forget(uint32_t first);
  template <class Take>
  void takeWritten(Triangles& triangles, const Take& take);

  const MeshStore positions_;
  const bool is_painted_;
  const Vec3i last_block_;  ///< The upper corner of the blocks' bounds.
  const Sink sink_;
  const uint32_t vertices_at_once_;
  BlockJoiner joiner_;
  Mesh window_;                    ///< The vertices from index first_ on.
  std::vector<uint32_t> numbers_;  ///< Output indices of these vertices, once written.
  Outline outline_;
  Triangles triangles_;         ///< Triangles not yet output.
  Triangles patches_;           ///< Triangles that fill holes; not all vertices are written yet.
  Triangles numbered_patches_;  ///< Triangles that fill holes, with output indices; output last.
  uint32_t first_ = 0, next_number_ = 0;
  std::array<std::deque<AddedBlock>, kSteps> ahead_;  ///< Blocks that each step has not passed.
  std::array<uint32_t, kSteps> passed_ = {};  ///< Number of vertices that each step has passed.
  std::array<uint32_t, kSteps> done_ = {};    ///< Number of vertices processed by each step.
};

}  // namespace dtsdf
