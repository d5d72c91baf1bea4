/// Refined meshes on the CPU: normals of a block's vertices, and four triangles for each one.
#pragma once

#include <vector>

#include "cpu/block_surface.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/refine.h"
#include "kernels/meshing/vertex_normal.h"

namespace dtsdf {

/// Normals of a block's edge vertices, in their order.
std::vector<Vec3f> vertexNormals(const ArraysAround& arrays,
                                 const std::vector<BlockVertex>& vertices, bool directional);

/// Some of a block's vertices, sorted by edge, and their normals.
struct KnownNormals {
  const std::vector<BlockVertex>& vertices;
  const std::vector<Vec3f>& normals;
};

/// Room for refining one block after the other; one per thread.
class BlockRefiner {
 public:
  /// Refines the mesh that the surface has made.
  void refine(const MeshSettings& rules, const ArraysAround& arrays, const BlockSurface& surface,
              const KnownNormals& known, bool directional, BlockMesh& mesh);

 private:
  void findNormals(const ArraysAround& arrays, const KnownNormals& known, bool directional,
                   const BlockMesh& mesh);
  void addMiddles(const BlockSurface& surface, const SurfaceUnit& unit, BlockMesh& mesh) const;

  std::vector<Vec3f> normals_;  ///< Of the mesh's edge vertices.
};

}  // namespace dtsdf
