#include "evaluation/boundary_edges.h"

#include <algorithm>
#include <numeric>

namespace dtsdf {
namespace {

/// The sides of all triangles. A side shared by n triangles is listed n times.
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

/// Merges vertices at the same position and drops triangles that become degenerate.
TriangleMesh withJoinedVertices(const TriangleMesh& mesh) {
  const auto position = [&](uint32_t i) {
    const Eigen::Vector3f& p = mesh.vertices[i];
    return std::array<float, 3>{p.x(), p.y(), p.z()};
  };
  std::vector<uint32_t> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return position(a) < position(b); });
  std::vector<uint32_t> joined(order.size());
  TriangleMesh result;
  for (size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || position(order[i]) != position(order[i - 1])) {
      result.vertices.push_back(mesh.vertices[order[i]]);
    }
    joined[order[i]] = static_cast<uint32_t>(result.vertices.size() - 1);
  }
  for (const auto& corners : mesh.triangles) {
    const uint32_t a = joined[corners[0]], b = joined[corners[1]], c = joined[corners[2]];
    if (a != b && b != c && c != a) result.triangles.push_back({a, b, c});
  }
  return result;
}

/// Counts closed loops in connected sets of 3 to 16 edges. Two loops that touch at a vertex count
/// as two.
size_t countSmallLoops(const std::vector<MeshEdge>& edges, size_t vertices) {
  constexpr size_t kMinEdges = 3, kMaxEdges = 16;
  std::vector<std::vector<uint32_t>> neighbours(vertices);
  for (const MeshEdge& edge : edges) {
    neighbours[edge[0]].push_back(edge[1]);
    neighbours[edge[1]].push_back(edge[0]);
  }
  std::vector<bool> visited(vertices, false);
  size_t loops = 0;
  for (const MeshEdge& edge : edges) {
    if (visited[edge[0]]) continue;
    visited[edge[0]] = true;
    std::vector<uint32_t> connected{edge[0]};
    size_t ends = 0;
    for (size_t i = 0; i < connected.size(); ++i) {
      for (const uint32_t next : neighbours[connected[i]]) {
        ++ends;
        if (!visited[next]) connected.push_back(next);
        visited[next] = true;
      }
    }
    const size_t count = ends / 2;
    if (count >= kMinEdges && count <= kMaxEdges) loops += count + 1 - connected.size();
  }
  return loops;
}

}  // namespace

std::vector<MeshEdge> boundaryEdges(const TriangleMesh& mesh) {
  std::vector<MeshEdge> sides = sidesOf(mesh);
  std::sort(sides.begin(), sides.end());
  std::vector<MeshEdge> boundary;
  for (size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end] == sides[begin]) ++end;
    if (end - begin == 1) boundary.push_back(sides[begin]);
  }
  return boundary;
}

MeshBorder measureBorder(const TriangleMesh& mesh) {
  const TriangleMesh joined = withJoinedVertices(mesh);
  const std::vector<MeshEdge> border = boundaryEdges(joined);
  return {border.size(), countSmallLoops(border, joined.vertices.size())};
}

}  // namespace dtsdf
