/// Triangulates grids of vertices.
#pragma once

#include <cstdint>
#include <vector>

namespace dtsdf {

/// Returns two triangles per square of a grid of side x side vertices. Vertex indices start at
/// `first` and are in row-major order.
inline std::vector<uint16_t> gridTriangles(int side, int first = 0) {
  std::vector<uint16_t> triangles;
  for (int y = 0; y + 1 < side; ++y) {
    for (int x = 0; x + 1 < side; ++x) {
      const int a = first + x + side * y, b = a + 1, c = a + side, d = c + 1;
      for (const int v : {a, b, d, a, d, c}) triangles.push_back(static_cast<uint16_t>(v));
    }
  }
  return triangles;
}

}  // namespace dtsdf
