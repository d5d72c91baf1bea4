/// The make stage of a block on the CPU: its mesh, from the indices of its units and of those
/// across its faces.
#pragma once

#include <cstdint>
#include <vector>

#include "cpu/block_indexer.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/regularisation.h"

namespace dtsdf {

/// Indices of the units in a block and in its six face neighbours, by regularisationOffset(); null
/// where there is no surface.
using IndexNeighbourhood = const UnitIndices* [kRegularisationReach];

/// A unit that holds a part of the surface, and its indices after regularisation.
struct SurfaceUnit {
  Vec3i at;
  UnitIndices indices;
};

/// Room for meshing one block after the other; one per thread.
class BlockSurface {
 public:
  /// Regularises the block's units and enters the edges of their triangles. The block has a
  /// surface.
  void regularise(const IndexNeighbourhood& indices);

  /// Vertices and triangles of what was regularised. Few edges differ from those before: `known`
  /// holds the vertices of some, sorted by edge.
  void emit(const MeshRules& rules, const NearbyArrays& arrays,
            const std::vector<BlockVertex>& known, bool directional, BlockMesh& mesh);

  /// Of what was regularised: its units, and, once it is emitted, the vertices of its edges.
  const std::vector<SurfaceUnit>& units() const { return surface_units_; }
  uint16_t vertexOf(int edge) const { return vertex_of_edge_[edge]; }

 private:
  static constexpr int kUnitGridSide = kBlockSide + 2;

  static int unitIndex(int x, int y, int z) {
    return x + 1 + kUnitGridSide * (y + 1 + kUnitGridSide * (z + 1));
  }

  void collect(const IndexNeighbourhood& indices);
  void addTriangles(const UnitIndices& regular, const Vec3i& unit);

  /// The block's units and a layer around them, of which edges and corners are never read.
  UnitIndices units_[kUnitGridSide * kUnitGridSide * kUnitGridSide] = {};
  std::vector<SurfaceUnit> surface_units_;
  EdgeSet edges_;  ///< That carry a vertex.
  uint16_t vertex_of_edge_[kGridEdges];
  std::vector<uint16_t> triangle_edges_;
};

}  // namespace dtsdf
