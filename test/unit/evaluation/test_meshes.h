/// Simple meshes for which the metrics are known exactly.
#pragma once

#include <cmath>

#include "evaluation/triangle_mesh.h"

namespace dtsdf {

inline void addQuad(TriangleMesh& mesh, const Eigen::Vector3f& a, const Eigen::Vector3f& b,
                    const Eigen::Vector3f& c, const Eigen::Vector3f& d) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {a, b, c, d});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

/// A rectangle from (x0, y0) to (x1, y1) at height z, facing up.
inline TriangleMesh makeRectangle(float x0, float y0, float x1, float y1, float z) {
  TriangleMesh mesh;
  addQuad(mesh, {x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z});
  return mesh;
}

/// A closed cube with shared vertices and side 2 * half, centred at the origin, facing outwards.
inline TriangleMesh makeCube(float half) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.emplace_back(i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half);
  }
  const uint32_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& f : faces) {
    mesh.triangles.push_back({f[0], f[1], f[2]});
    mesh.triangles.push_back({f[0], f[2], f[3]});
  }
  return mesh;
}

/// A sphere centred at the origin, with `rings` rings of 2 * rings facets. All vertices lie exactly
/// on the sphere.
inline TriangleMesh makeSphere(float radius_m, uint32_t rings) {
  constexpr double kPi = 3.14159265358979323846;
  TriangleMesh mesh;
  const uint32_t columns = 2 * rings;
  for (uint32_t i = 0; i <= rings; ++i) {
    for (uint32_t k = 0; k < columns; ++k) {
      const double polar = kPi * i / rings, azimuth = 2.0 * kPi * k / columns;
      mesh.vertices.push_back(radius_m * Eigen::Vector3d(std::sin(polar) * std::cos(azimuth),
                                                         std::sin(polar) * std::sin(azimuth),
                                                         std::cos(polar))
                                             .cast<float>());
    }
  }
  const auto index = [&](uint32_t i, uint32_t k) {
    const bool pole = i == 0 || i == rings;  // all facets at a pole share one vertex
    return i * columns + (pole ? 0 : k % columns);
  };
  for (uint32_t i = 0; i < rings; ++i) {
    for (uint32_t k = 0; k < columns; ++k) {
      const uint32_t a = index(i, k), b = index(i, k + 1);
      const uint32_t c = index(i + 1, k), d = index(i + 1, k + 1);
      if (i + 1 < rings) mesh.triangles.push_back({a, c, d});
      if (i > 0) mesh.triangles.push_back({a, d, b});
    }
  }
  return mesh;
}

inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const auto first = static_cast<uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& t : b.triangles) {
    a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  return a;
}

inline TriangleMesh moved(TriangleMesh mesh, const Eigen::Vector3f& by) {
  for (Eigen::Vector3f& p : mesh.vertices) p += by;
  return mesh;
}

}  // namespace dtsdf
