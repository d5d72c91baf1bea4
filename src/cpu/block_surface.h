/// The mesh of one block, from the indices of its units and of those across its faces.
#pragma once

#include <cstdint>
#include <vector>

#include "cpu/block_lattice.h"
#include "dtsdf_mapping/block_mesh.h"

namespace dtsdf {

/// Indices of the units in a block and in its six face neighbours, by regularisationOffset(); null
/// where there is no surface.
using IndexNeighbourhood = const UnitIndices* [kRegularisationReach];

/// Room for meshing one block after the other; one per thread.
class BlockSurface {
 public:
  /// Regularises the block's units and enters the edges of their triangles. The block has a surface.
  void settle(const IndexNeighbourhood& indices);

  /// The mesh of what was settled. Few edges differ from those before: `known` holds the vertices of
  /// some, sorted by edge.
  void emit(const LatticeArrays& arrays, const std::vector<BlockVertex>& known, bool directional,
            BlockMesh& mesh);

 private:
  static constexpr int kGridSide = kBlockSide + 2;

  static int gridIndex(int x, int y, int z) {
    return x + 1 + kGridSide * (y + 1 + kGridSide * (z + 1));
  }

  void collect(const IndexNeighbourhood& indices);
  void addTriangles(const UnitIndices& settled, const Vec3i& unit);

  /// The block's units and a layer around them, of which edges and corners are never read.
  UnitIndices grid_[kGridSide * kGridSide * kGridSide] = {};
  EdgeSet edges_;  ///< That carry a vertex.
  uint16_t vertex_of_edge_[kLatticeEdges];
  std::vector<uint16_t> triangle_edges_;
};

}  // namespace dtsdf
