/// Refined meshes on the CPU: normals of a block's vertices, and four triangles for each one.
#pragma once

#include <vector>

#include "cpu/block_surface.h"
#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/refine.h"
#include "kernels/meshing/vertex_normal.h"

namespace dtsdf {

/// Normals of a block's edge vertices, in their order. `Samples` are of the block's corner grid and
/// one more layer around it.
template <class Samples>
std::vector<Vec3f> vertexNormals(const Samples& samples, const std::vector<BlockVertex>& vertices,
                                 bool directional) {
  std::vector<Vec3f> normals;
  normals.reserve(vertices.size());
  for (const BlockVertex& vertex : vertices) {
    normals.push_back(
        vertexNormal(samples, static_cast<int>(vertex.edge), vertex.position, directional));
  }
  return normals;
}

/// Some of a block's vertices, sorted by edge, and their normals.
struct KnownNormals {
  const std::vector<BlockVertex>& vertices;
  const std::vector<Vec3f>& normals;
};

/// Room for refining one block after the other; one per thread.
class BlockRefiner {
 public:
  /// Refines the mesh that the surface has made.
  void refine(const MeshSettings& rules, const NearbyArrays& arrays, const BlockSurface& surface,
              const KnownNormals& known, bool directional, BlockMesh& mesh);

 private:
  void findNormals(const NearbyArrays& arrays, const KnownNormals& known, bool directional,
                   const BlockMesh& mesh);
  void addMiddles(const BlockSurface& surface, const SurfaceUnit& unit, BlockMesh& mesh) const;

  std::vector<Vec3f> normals_;  ///< Of the mesh's edge vertices.
};

}  // namespace dtsdf
