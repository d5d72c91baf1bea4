#include "support/mesh_topology.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

namespace dtsdf {
namespace {

/// How often triangles traverse an edge from the smaller to the greater vertex index (up), or in
/// the opposite direction (down).
struct Passes {
  int up = 0, down = 0;
};

double areaTwice(const Mesh& mesh, const Triangle& t) {
  const auto corner = [&](int i) {
    const Vec3f& p = mesh.vertices_m[t[i]];
    return Eigen::Vector3d(p.x, p.y, p.z);
  };
  return (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
}

size_t countCoincident(const Mesh& mesh) {
  std::vector<std::tuple<float, float, float>> positions;
  for (const Vec3f& p : mesh.vertices_m) positions.emplace_back(p.x, p.y, p.z);
  std::sort(positions.begin(), positions.end());
  const auto unique_end = std::unique(positions.begin(), positions.end());
  return static_cast<size_t>(positions.end() - unique_end);
}

}  // namespace

std::ostream& operator<<(std::ostream& out, const MeshTopology& t) {
  return out << t.triangles << " triangles, " << t.boundary_edges << " boundary edges, "
             << t.nonmanifold_edges << " non-manifold, " << t.inconsistent_edges
             << " inconsistent, " << t.repeated_corners << " repeated corners, " << t.zero_areas
             << " zero areas, " << t.unused_vertices << " unused vertices, "
             << t.coincident_vertices << " coincident";
}

MeshTopology measureTopology(const std::vector<Triangle>& triangles) {
  MeshTopology topology;
  topology.triangles = triangles.size();
  std::map<std::pair<uint32_t, uint32_t>, Passes> sides;
  for (const Triangle& t : triangles) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) ++topology.repeated_corners;
    for (int i = 0; i < 3; ++i) {
      const uint32_t a = t[i], b = t[(i + 1) % 3];
      Passes& passes = sides[{std::min(a, b), std::max(a, b)}];
      ++(a < b ? passes.up : passes.down);
    }
  }
  for (const auto& [side, passes] : sides) {
    const int sum = passes.up + passes.down;
    topology.boundary_edges += sum == 1;
    topology.nonmanifold_edges += sum > 2;
    topology.inconsistent_edges += sum > 1 && passes.up != passes.down;
  }
  return topology;
}

MeshTopology measureTopology(const Mesh& mesh) {
  MeshTopology topology = measureTopology(mesh.triangles);
  std::vector<bool> used(mesh.vertices_m.size(), false);
  for (const Triangle& t : mesh.triangles) {
    topology.zero_areas += !(areaTwice(mesh, t) > 0.0);
    for (const uint32_t v : t) used[v] = true;
  }
  topology.unused_vertices = static_cast<size_t>(std::count(used.begin(), used.end(), false));
  topology.coincident_vertices = countCoincident(mesh);
  return topology;
}

}  // namespace dtsdf
