/// The stage "make" for one block on the CPU: computes its mesh from the labels of its units and of
/// the units around the block.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "cpu/block_indexer.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/gap.h"
#include "kernels/meshing/refine.h"
#include "kernels/meshing/regularisation.h"
#include "kernels/meshing/vertex_normal.h"

namespace dtsdf {

/// Normals of a block's edge vertices, in the order of `vertices`.
std::vector<Vec3f> vertexNormals(const ArraysAround& arrays,
                                 const std::vector<BlockVertex>& vertices, bool directional);

/// Meshes one block at a time. Each thread needs its own instance, as it contains buffers.
class BlockSurface {
 public:
  /// Regularises the block's units and finds the edges of their triangles.
  /// @pre At least one unit of the block is not empty.
  void regularise(const LabelNeighbourhood& labels);

  /// Computes the vertices and triangles of the regularised units. Marks triangles that span a gap.
  /// @param known Vertices from the index stage, sorted by edge. Missing vertices are computed
  /// here.
  void emit(const MeshSettings& rules, const ArraysAround& arrays,
            const std::vector<BlockVertex>& known, bool directional, BlockMesh& mesh);

  /// Refines the mesh from emit(): each triangle becomes four.
  /// @param normals The normals of `known`, in the same order.
  void refine(const MeshSettings& rules, const ArraysAround& arrays,
              const std::vector<BlockVertex>& known, const std::vector<Vec3f>& normals,
              bool directional, BlockMesh& mesh);

 private:
  void findMajorities(const LabelNeighbourhood& labels);
  void countSides(const UnitLabels& labels, const Vec3i& unit);
  void addTriangles(const UnitIndices& regular, const Vec3i& unit);
  void findNormals(const ArraysAround& arrays, const std::vector<BlockVertex>& known,
                   const std::vector<Vec3f>& normals, bool directional, const BlockMesh& mesh);
  void addMidpoints(const Vec3i& unit, const UnitIndices& indices, BlockMesh& mesh) const;

  uint8_t is_behind_[kGridCorners];  ///< Per corner: 1 if it is behind the surface by majority.
  /// Units with triangles, and their marching-cubes cases after regularisation.
  std::vector<std::pair<Vec3i, UnitIndices>> surface_units_;
  EdgeSet edges_;  ///< Edges with a vertex.
  uint16_t vertex_of_edge_[kGridEdges];
  bool is_pulled_far_[kGridEdges];  ///< Per vertex, see isPulledFar().
  std::vector<Vec3f> normals_;      ///< One per edge vertex, if meshes are refined.
};

}  // namespace dtsdf
