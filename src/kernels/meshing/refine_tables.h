/// Tables of refined marching cubes, derived at compile time from mesh_tables.h: the sides of an
/// index's triangles, each once, and which of them bound each triangle.
#pragma once

#include "kernels/meshing/mesh_tables.h"

namespace dtsdf {

/// A loop of n edges has n sides and n - 3 diagonals: with all twelve edges crossed, by four loops
/// of three, that is twelve sides.
constexpr int kMaxSides = 12;

struct RefineTables {
  /// Sides of an index, in the order of its triangles: two of the unit's edges each.
  uint8_t side_count[256];
  uint8_t side_edge[256][2 * kMaxSides];
  /// For each triangle the sides from its first corner to the second one, and on.
  uint8_t triangle_side[256][3 * kMaxTriangles];
};

namespace refine_tables_detail {

/// The number of the side between two edges of an index, which is entered if it is new.
constexpr uint8_t sideBetween(RefineTables& tables, int index, uint8_t a, uint8_t b) {
  const uint8_t count = tables.side_count[index];
  for (uint8_t i = 0; i < count; ++i) {
    const uint8_t first = tables.side_edge[index][2 * i];
    const uint8_t second = tables.side_edge[index][2 * i + 1];
    if ((first == a && second == b) || (first == b && second == a)) return i;
  }
  tables.side_edge[index][2 * count] = a;
  tables.side_edge[index][2 * count + 1] = b;
  tables.side_count[index] = static_cast<uint8_t>(count + 1);
  return count;
}

constexpr RefineTables make() {
  RefineTables tables{};
  for (int index = 0; index < 256; ++index) {
    for (int t = 0; t < kMeshTables.triangle_count[index]; ++t) {
      const uint8_t* corner = &kMeshTables.triangle_edge[index][3 * t];
      for (int k = 0; k < 3; ++k) {
        tables.triangle_side[index][3 * t + k] =
            sideBetween(tables, index, corner[k], corner[(k + 1) % 3]);
      }
    }
  }
  return tables;
}

}  // namespace refine_tables_detail

/// More sides than kMaxSides would not compile: no constant expression writes beyond an array.
inline constexpr RefineTables kRefineTables = refine_tables_detail::make();

}  // namespace dtsdf
