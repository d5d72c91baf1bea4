#include "io/saved_mesh.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "dtsdf_mapping/io/mesh_file.h"
#include "io/ply_stream.h"
#include "kernels/core/grid.h"
#include "map/region_view.h"

namespace dtsdf {
namespace {

/// @param before Failures before they were read.
void throwIfUnread(const PagedMeshes& meshes, uint64_t before) {
  const PagedMeshes::Stats stats = meshes.stats();
  if (stats.failures == before) return;
  throw std::runtime_error("no mesh was saved: " + stats.problem);
}

/// Blocks that the mesh of a region may come from.
std::vector<PackedKey> blocksIn(const BoxRegion& region, const PagedMeshes& meshes) {
  const RegionView in_voxels = makeRegionView(region, meshes.voxelSize());
  std::vector<PackedKey> keys = meshes.keys();
  const auto is_outside = [&](PackedKey key) { return !mayShapeMeshIn(in_voxels, unpackKey(key)); };
  keys.erase(std::remove_if(keys.begin(), keys.end(), is_outside), keys.end());
  return keys;
}

/// The same file as of the whole mesh, block by block.
SavedMesh saveInPieces(PagedMeshes& meshes, MeshColour colour, const std::string& path) {
  const uint64_t failures = meshes.stats().failures;
  PlyStream file(path, colour);
  meshes.stream({[&](const Mesh& piece) { file.addVertices(piece); },
                 [&](const std::array<uint32_t, 3>& corners) { file.addTriangle(corners); }});
  throwIfUnread(meshes, failures);  // before it gets its name
  file.finish();
  return {static_cast<size_t>(file.vertices()), static_cast<size_t>(file.triangles()), 0.0, ""};
}

Mesh assemble(PagedMeshes& meshes, const std::optional<BoxRegion>& region) {
  const uint64_t failures = meshes.stats().failures;
  const MeshStore& store = region ? meshes.holding(blocksIn(*region, meshes)) : meshes.all();
  Mesh mesh = region ? store.assemble(*region) : store.assemble();
  meshes.dropFetched();
  throwIfUnread(meshes, failures);
  return mesh;
}

}  // namespace

SavedMesh savePagedMesh(PagedMeshes& meshes, MeshColour colour, const std::string& path,
                        const SaveChoice& choice) {
  const bool is_plain = !choice.region && choice.simplify_error_m == 0.0;
  if (meshes.isPaged() && is_plain && meshFormatOf(path) == MeshFormat::kPly) {
    return saveInPieces(meshes, colour, path);
  }
  SimplifiedMesh saved{assemble(meshes, choice.region)};
  if (choice.region && saved.mesh.triangles.empty() && meshes.triangleCount() > 0) {
    throw std::runtime_error(
        "no triangle lies wholly in the region, in map frame coordinates; nothing was saved");
  }
  if (choice.simplify_error_m != 0.0) {
    saved = simplifyMesh(saved.mesh, choice.simplify_error_m, choice.go_on);
  }
  saveMesh(saved.mesh, colour, path);
  return {saved.mesh.vertices_m.size(), saved.mesh.triangles.size(), saved.error_m,
          lossInFormat(saved.mesh, path)};
}

}  // namespace dtsdf
