#include "evaluation/boundary_edges.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace dtsdf {
namespace {

using Cell = std::array<int64_t, 3>;

/// Points sorted into cubes of a given edge.
class PointGrid {
 public:
  PointGrid(const std::vector<Eigen::Vector3f>& points, float side_m) : side_m_(side_m) {
    for (const Eigen::Vector3f& p : points) cells_[cellOf(p)].push_back(p);
  }

  /// Whether some point is no farther away than a cube's edge.
  bool hasNear(const Eigen::Vector3f& p) const {
    const Cell at = cellOf(p);
    for (int n = 0; n < 27; ++n) {
      const auto cell = cells_.find({at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1});
      if (cell == cells_.end()) continue;
      const auto is_near = [&](const Eigen::Vector3f& q) { return (q - p).norm() <= side_m_; };
      if (std::any_of(cell->second.begin(), cell->second.end(), is_near)) return true;
    }
    return false;
  }

 private:
  Cell cellOf(const Eigen::Vector3f& p) const {
    const auto along = [&](float x) { return static_cast<int64_t>(std::floor(x / side_m_)); };
    return {along(p.x()), along(p.y()), along(p.z())};
  }

  float side_m_;
  std::map<Cell, std::vector<Eigen::Vector3f>> cells_;
};

/// The sides of all triangles, each as often as there are triangles that have it.
std::vector<MeshEdge> sidesOf(const TriangleMesh& mesh) {
  std::vector<MeshEdge> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t a = triangle[i], b = triangle[(i + 1) % 3];
      if (a != b) sides.push_back({std::min(a, b), std::max(a, b)});
    }
  }
  return sides;
}

}  // namespace

MeshEdges findEdges(const TriangleMesh& mesh) {
  std::vector<MeshEdge> sides = sidesOf(mesh);
  std::sort(sides.begin(), sides.end());
  MeshEdges edges;
  for (size_t begin = 0; begin < sides.size();) {
    size_t end = begin;
    while (end < sides.size() && sides[end] == sides[begin]) ++end;
    if (end - begin == 1) edges.boundary.push_back(sides[begin]);
    if (end - begin > 2) ++edges.non_manifold;
    begin = end;
  }
  return edges;
}

float medianEdgeLength(const TriangleMesh& mesh) {
  std::vector<float> lengths;
  for (const MeshEdge& side : sidesOf(mesh)) {
    lengths.push_back((mesh.vertices[side[0]] - mesh.vertices[side[1]]).norm());
  }
  if (lengths.empty()) return 0.0f;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

size_t countBeside(const TriangleMesh& mesh, const std::vector<MeshEdge>& edges,
                   const std::vector<Eigen::Vector3f>& points, float reach_m) {
  if (!(reach_m > 0.0f)) return 0;
  const PointGrid grid(points, reach_m);
  return static_cast<size_t>(std::count_if(edges.begin(), edges.end(), [&](const MeshEdge& edge) {
    return grid.hasNear(0.5f * (mesh.vertices[edge[0]] + mesh.vertices[edge[1]]));
  }));
}

}  // namespace dtsdf
