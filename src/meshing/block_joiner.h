/// Joins the meshes of blocks: vertices that neighbours repeat become one, and get normals.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/corner_grid.h"

namespace dtsdf {

/// What has become of a block's vertices.
struct JoinedBlock {
  std::vector<uint32_t> number;  ///< Of each vertex among those of all blocks.
  std::vector<uint32_t> fresh;   ///< Which of them no block before had; numbered in this order.
};

/// Numbers the vertices of blocks in the order in which they are added. Keeps only which vertices
/// later blocks may share, so that a mesh that fills the memory can be joined.
class BlockJoiner {
 public:
  /// `in_order`: blocks will be added by rising packed keys, and what none shares any more is
  /// forgotten.
  explicit BlockJoiner(bool in_order) : in_order_(in_order) {}

  /// The result is valid until the next call.
  const JoinedBlock& add(const BlockMesh& block);

 private:
  /// The middle of a side: the numbers of its two ends in the whole mesh, the lower one first.
  struct GlobalSide {
    uint32_t first, second;
    bool operator==(const GlobalSide& other) const {
      return first == other.first && second == other.second;
    }
  };
  struct GlobalSideHash {
    size_t operator()(const GlobalSide& s) const {
      return static_cast<size_t>(hashKey(uint64_t{s.first} << 32 | s.second));
    }
  };

  /// Vertices that more than one block may list, by the block that is the last to list them.
  struct SharedVertices {
    std::unordered_map<uint32_t, uint32_t> edges;  ///< Number in the mesh, by the owner's edge.
    std::unordered_map<GlobalSide, uint32_t, GlobalSideHash> sides;
  };

  uint32_t numberOf(const BlockMesh& block, PackedKey key, size_t i);
  uint32_t numberOfEdge(PackedKey owner, uint32_t edge, PackedKey key);

  const bool in_order_;
  uint32_t next_ = 0;  ///< The number of the next vertex that is new.
  JoinedBlock joined_;
  std::map<PackedKey, SharedVertices> shared_;
  /// Of those in the block that is being added.
  std::array<uint32_t, kGridEdges> number_of_edge_ = {};
};

/// Adds the normal of a block's triangle, whose corners in the block begin at `corner`, to those of
/// its vertices `t`, by its area. At the rim of what was seen anchoring may fold a triangle: it
/// faces against what its edges face, which no triangle does whose vertices are on their edges. Its
/// normal counts turned round. From positions in the block, which are as good anywhere in the map.
void addNormal(const BlockMesh& block, const uint16_t* corner, const std::array<uint32_t, 3>& t,
               std::vector<Vec3f>& normals);

/// Makes sums of normals unit normals; up where they are 0.
void makeUnit(std::vector<Vec3f>& normals);

}  // namespace dtsdf
