#include "io/saved_mesh.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "dtsdf_mapping/io/mesh_file.h"
#include "io/atomic_file.h"
#include "io/ply.h"
#include "kernels/core/grid.h"
#include "map/region_view.h"

namespace dtsdf {
namespace {

/// Describes the blocks missing from a mesh; empty if it is complete.
/// @param before Value of meshes.missed() before the mesh was read.
/// @throws std::runtime_error if the disk cannot be read, which may be temporary.
std::string describeMissing(PagedMeshes& meshes, uint64_t before) {
  if (meshes.missed() == before) return "";
  const std::string problem = meshes.stats().problem;
  if (!meshes.diskResponds()) throw std::runtime_error("no mesh was saved: " + problem);
  return std::to_string(meshes.missed() - before) +
         " blocks of the mesh cannot be read and are not in the file: " + problem;
}

/// Blocks that may contribute to the mesh in a region.
std::vector<PackedKey> blocksIn(const BoxRegion& region, const PagedMeshes& meshes) {
  const RegionView in_voxels = makeRegionView(region, meshes.voxelSize());
  std::vector<PackedKey> keys = meshes.keys();
  const auto is_outside = [&](PackedKey key) {
    return !mayAffectMeshIn(in_voxels, unpackKey(key));
  };
  keys.erase(std::remove_if(keys.begin(), keys.end(), is_outside), keys.end());
  return keys;
}

/// Saves the same file as saveMesh() in three passes over the blocks: the first counts vertices and
/// triangles for the header, the second writes vertices, and the third writes triangles.
SavedMesh saveInPieces(PagedMeshes& meshes, MeshColour colour, const std::string& path) {
  const uint64_t missed = meshes.missed();
  size_t vertices = 0, triangles = 0;
  bool is_far = false;
  meshes.stream({[&](const Mesh& piece) {
                   vertices += piece.vertices_m.size();
                   is_far = isFarFromOrigin(piece);
                 },
                 [&](const auto&) { ++triangles; }});
  std::string lack = describeMissing(meshes, missed);
  const uint64_t lacking = meshes.missed() - missed;
  checkMeshSize(vertices, triangles, path);
  AtomicFile file(path);
  file.write(plyHeader(vertices, triangles, is_far));
  meshes.stream({[&](const Mesh& piece) {
                   for (size_t i = 0; i < piece.vertices_m.size(); ++i) {
                     writePlyVertex(piece, i, colour, file);
                   }
                 },
                 [](const auto&) {}});
  meshes.stream(
      {[](const Mesh&) {}, [&](const auto& corners) { writePlyTriangle(corners, file); }});
  if (meshes.missed() - missed != 3 * lacking) {
    throw std::runtime_error("no mesh was saved: " + meshes.stats().problem);
  }
  file.commit();
  return {vertices, triangles, 0.0, std::move(lack), triangles};
}

Mesh assemble(PagedMeshes& meshes, const std::optional<BoxRegion>& region, std::string& lack) {
  const uint64_t missed = meshes.missed();
  const MeshStore store = region ? meshes.holding(blocksIn(*region, meshes)) : meshes.all();
  Mesh mesh = region ? store.assemble(*region) : store.assemble();
  lack = describeMissing(meshes, missed);
  return mesh;
}

}  // namespace

SavedMesh savePagedMesh(PagedMeshes& meshes, MeshColour colour, const std::string& path,
                        const std::optional<BoxRegion>& region, double simplify_error_m,
                        const SimplifyProgress& progress) {
  const bool is_plain = !region && simplify_error_m == 0.0;
  if (meshes.isPaged() && is_plain && meshFormatOf(path) == ".ply") {
    return saveInPieces(meshes, colour, path);
  }
  std::string lack;
  SimplifiedMesh saved{assemble(meshes, region, lack)};
  if (region && saved.mesh.triangles.empty() && meshes.triangleCount() > 0) {
    throw std::runtime_error(
        "no triangle lies wholly in the region (in map coordinates); nothing was saved");
  }
  const size_t joined = saved.mesh.triangles.size();
  if (simplify_error_m != 0.0) {
    saved = simplifyMesh(saved.mesh, simplify_error_m, progress);
  }
  saveMesh(saved.mesh, colour, path);
  if (lack.empty()) lack = lossInFormat(saved.mesh, path);
  return {saved.mesh.vertices_m.size(), saved.mesh.triangles.size(), saved.error_m, std::move(lack),
          joined};
}

}  // namespace dtsdf
