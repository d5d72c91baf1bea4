#include "cpu/block_refiner.h"

namespace dtsdf {

std::vector<Vec3f> vertexNormals(const ArraysAround& arrays,
                                 const std::vector<BlockVertex>& vertices, bool directional) {
  std::vector<Vec3f> normals;
  normals.reserve(vertices.size());
  for (const BlockVertex& vertex : vertices) {
    normals.push_back(
        vertexNormal(arrays, static_cast<int>(vertex.edge), vertex.position, directional));
  }
  return normals;
}

void BlockRefiner::findNormals(const ArraysAround& arrays, const KnownNormals& known,
                               bool directional, const BlockMesh& mesh) {
  normals_.clear();
  size_t next = 0;
  for (const BlockVertex& vertex : mesh.vertices) {
    while (next < known.vertices.size() && known.vertices[next].edge < vertex.edge) ++next;
    const bool is_known = next < known.vertices.size() && known.vertices[next].edge == vertex.edge;
    normals_.push_back(is_known ? known.normals[next]
                                : vertexNormal(arrays, static_cast<int>(vertex.edge),
                                               vertex.position, directional));
  }
}

void BlockRefiner::addMiddles(const BlockSurface& surface, const SurfaceUnit& unit,
                              BlockMesh& mesh) const {
  const auto endOn = [&](int edge) {
    const uint16_t vertex = surface.vertexOf(edge);
    return SideEnd{mesh.vertices[vertex].position, normals_[vertex]};
  };
  visitSides(kRefineTables, unit.indices, unit.at, [&](int a, int b) {
    mesh.vertices.push_back({middleOfSide(endOn(a), endOn(b)), middleNumber(a, b)});
  });
}

void BlockRefiner::refine(const MeshSettings& rules, const ArraysAround& arrays,
                          const BlockSurface& surface, const KnownNormals& known, bool directional,
                          BlockMesh& mesh) {
  findNormals(arrays, known, directional, mesh);
  size_t middles = 0;
  for (const SurfaceUnit& unit : surface.units()) {
    middles += sidesOfUnit(kRefineTables, unit.indices);
  }
  mesh.vertices.reserve(mesh.vertices.size() + middles);
  const size_t triangle_corners = kRefinedTriangles * mesh.triangles.size();
  mesh.triangles.clear();
  mesh.triangles.reserve(triangle_corners);
  for (const SurfaceUnit& unit : surface.units()) {
    const uint32_t first_middle = static_cast<uint32_t>(mesh.vertices.size());
    addMiddles(surface, unit, mesh);
    visitRefinedTriangles(
        kMeshTables, kRefineTables, unit.indices, unit.at, first_middle,
        [&](int edge) { return uint32_t{surface.vertexOf(edge)}; },
        [&](const uint32_t(&corner)[3]) {
          return standsInGap(rules, mesh.vertices[corner[0]], mesh.vertices[corner[1]],
                             mesh.vertices[corner[2]]);
        },
        [&](uint32_t vertex) { mesh.triangles.push_back(static_cast<uint16_t>(vertex)); });
  }
}

}  // namespace dtsdf
