/// The make stage of a block on the CPU: its mesh, from the labels of its units and of those
/// around it.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "cpu/block_indexer.h"
#include "cpu/loose_units.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/gap.h"
#include "kernels/meshing/refine.h"
#include "kernels/meshing/regularisation.h"
#include "kernels/meshing/vertex_normal.h"

namespace dtsdf {

/// Normals of a block's edge vertices, in their order.
std::vector<Vec3f> vertexNormals(const ArraysAround& arrays,
                                 const std::vector<BlockVertex>& vertices, bool directional);

/// Room for meshing one block after the other; one per thread.
class BlockSurface {
 public:
  /// Regularises the block's units and enters the edges of their triangles, but for those of loose
  /// pieces of up to so many units. Some unit of the block says something.
  void regularise(const LabelNeighbourhood& labels, int most_loose_units);

  /// Vertices and triangles of what was regularised, those in gaps marked. Few edges differ from
  /// those before: `known` holds the vertices of some, sorted by edge.
  void emit(const MeshSettings& rules, const ArraysAround& arrays,
            const std::vector<BlockVertex>& known, bool directional, BlockMesh& mesh);

  /// Refines the mesh that was emitted: four triangles for each one. The known vertices are given
  /// with their normals.
  void refine(const MeshSettings& rules, const ArraysAround& arrays,
              const std::vector<BlockVertex>& known, const std::vector<Vec3f>& normals,
              bool directional, BlockMesh& mesh);

 private:
  void weighCorners(const LabelNeighbourhood& labels);
  void addSides(const UnitLabels& labels, const Vec3i& unit);
  void addUnits(const UnitLabels* labels, const BlockBits& loose);
  void addTriangles(const UnitIndices& regular, const Vec3i& unit);
  void findNormals(const ArraysAround& arrays, const std::vector<BlockVertex>& known,
                   const std::vector<Vec3f>& normals, bool directional, const BlockMesh& mesh);
  void addMiddles(const Vec3i& unit, const UnitIndices& indices, BlockMesh& mesh) const;

  int8_t balance_[kGridCorners];  ///< Per corner, see cornerBalance().
  BlockBits holding_surface_;     ///< Units that hold a surface before they are regularised.
  /// Units that hold a part of the surface, and their indices after regularisation.
  std::vector<std::pair<Vec3i, UnitIndices>> surface_units_;
  EdgeSet edges_;  ///< Those that carry a vertex.
  uint16_t vertex_of_edge_[kGridEdges];
  bool is_drawn_far_[kGridEdges];  ///< isDrawnFar() of each vertex: no other stands at a gap.
  std::vector<Vec3f> normals_;     ///< One per edge vertex, where meshes are refined.
};

}  // namespace dtsdf
