/// Refinement, the last step of the make stage where it is asked for: each triangle becomes four,
/// with new vertices at the middles of its sides, on the curved surface.
///
/// A middle is that of a PN triangle's side (Vlachos et al., Curved PN Triangles, 2001): of the
/// cubic that leaves both ends of the side in their tangent planes. It depends on the two ends and
/// their normals alone, so all triangles that have the side share it, in units and blocks alike.
///
/// A side of a triangle is identified by the edges of its two ends, like a vertex by its edge.
#pragma once

#include "kernels/core/grid.h"
#include "kernels/meshing/emit.h"
#include "kernels/meshing/gap.h"
#include "kernels/meshing/mesh_tables.h"

namespace dtsdf {

/// A loop of n edges has n sides and n - 3 diagonals: with all twelve edges crossed, by four loops
/// of three, that is twelve sides.
constexpr int kMaxSides = 12;

/// Derived at compile time from mesh_tables.h: the sides of an index's triangles, each once, and
/// which of them bound each triangle.
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

/// Triangles of a refined mesh for each one of a plain mesh.
constexpr int kRefinedTriangles = 4;

static_assert(kGridEdges + kVoxelsPerBlock * kMaxSheets * kMaxSides <= 65536,
              "triangles name a block's vertices in 16 bits");

/// BlockVertex::edge of the middle of a side between the vertices of two edges, in either order.
constexpr uint32_t kFirstMiddle = kGridEdges;
DTSDF_HD uint32_t middleNumber(int edge_a, int edge_b) {
  const uint32_t a = static_cast<uint32_t>(edge_a < edge_b ? edge_a : edge_b);
  const uint32_t b = static_cast<uint32_t>(edge_a < edge_b ? edge_b : edge_a);
  return kFirstMiddle + a * kGridEdges + b;
}
DTSDF_HD bool isMiddle(uint32_t number) { return number >= kFirstMiddle; }

/// The edges at both ends of the middle's side, the lower one first.
DTSDF_HD int middleFirst(uint32_t number) {
  return static_cast<int>((number - kFirstMiddle) / kGridEdges);
}
DTSDF_HD int middleSecond(uint32_t number) {
  return static_cast<int>((number - kFirstMiddle) % kGridEdges);
}

/// The way that a vertex's edge faces, or the sum of those of a middle's two.
DTSDF_HD Vec3i facedWays(uint32_t number) {
  if (!isMiddle(number)) return facedWay(static_cast<int>(number));
  return facedWay(middleFirst(number)) + facedWay(middleSecond(number));
}

/// A vertex of a side, with its unit normal: 0 where that is not known.
struct SideEnd {
  Vec3f position, normal;
};

/// A multiple of 2^-16, so that blocks on both sides of a face, whose positions differ by whole
/// blocks, come to the very same place.
DTSDF_HD float roundedShift(float shift) {
  constexpr float kSteps = 65536.0f;
  return static_cast<float>(floorToInt(shift * kSteps + 0.5f)) / kSteps;
}

/// The middle of the curved side between two vertices; an end without a normal counts as straight.
/// Swapping the ends changes nothing, not even a bit. The way from the straight side is at most a
/// quarter of it.
DTSDF_HD Vec3f middleOfSide(const SideEnd& a, const SideEnd& b) {
  const Vec3f way = b.position - a.position;
  const Vec3f at_a = dot(way, a.normal) * a.normal, at_b = dot(way, b.normal) * b.normal;
  const Vec3f shift = 0.125f * (at_b - at_a);
  return 0.5f * (a.position + b.position) +
         Vec3f{roundedShift(shift.x), roundedShift(shift.y), roundedShift(shift.z)};
}

/// Sides of a unit's triangles: those of each sheet once.
DTSDF_HD uint32_t sidesOfUnit(const RefineTables& tables, const UnitIndices& indices) {
  uint32_t sides = 0;
  for (int s = 0; s < kMaxSheets; ++s) sides += tables.side_count[indices.sheet[s]];
  return sides;
}

/// Calls visit(a, b) for these, with the edges that their ends are on, in canonical order.
template <class Visit>
DTSDF_HD void visitSides(const RefineTables& tables, const UnitIndices& indices, const Vec3i& unit,
                         const Visit& visit) {
  for (int s = 0; s < kMaxSheets; ++s) {
    const uint8_t index = indices.sheet[s];
    for (int i = 0; i < tables.side_count[index]; ++i) {
      const uint8_t* edge = tables.side_edge[index] + 2 * i;
      visit(unitEdge(unit, edge[0], index), unitEdge(unit, edge[1], index));
    }
  }
}

/// Calls visit(vertex) for the corners of the four triangles with the given corners and middles,
/// where middle i is that behind corner i.
template <class Visit>
DTSDF_HD void visitFour(const uint32_t (&corner)[3], const uint32_t (&middle)[3],
                        const Visit& visit) {
  for (int k = 0; k < 3; ++k) {
    visit(corner[k]);
    visit(middle[k]);
    visit(middle[(k + 2) % 3]);
  }
  for (int k = 0; k < 3; ++k) visit(middle[k]);
}

/// Calls visit(vertex) for the corners of a unit's refined triangles, three each, in canonical
/// order. `vertexOf` gives the vertex of an edge; the unit's middles begin at first_middle. Where
/// isGap() says that a triangle's corners stand in a gap, its four are marked as such.
template <class VertexOf, class IsGap, class Visit>
DTSDF_HD void visitRefinedTriangles(const MeshTables& tables, const RefineTables& refine_tables,
                                    const UnitIndices& indices, const Vec3i& unit,
                                    uint32_t first_middle, const VertexOf& vertexOf,
                                    const IsGap& isGap, const Visit& visit) {
  const int first_edge = firstEdge(unit);
  for (int s = 0; s < kMaxSheets; ++s) {
    const uint8_t index = indices.sheet[s];
    for (int t = 0; t < tables.triangle_count[index]; ++t) {
      uint32_t corner[3], middle[3];
      for (int k = 0; k < 3; ++k) {
        corner[k] = vertexOf(first_edge + tables.grid_edge[index][3 * t + k]);
        middle[k] = first_middle + refine_tables.triangle_side[index][3 * t + k];
      }
      if (isGap(corner)) {
        for (int k = 0; k < 3 * kRefinedTriangles; ++k) visit(uint32_t{kGapVertex});
      } else {
        visitFour(corner, middle, visit);
      }
    }
    first_middle += refine_tables.side_count[index];
  }
}

}  // namespace dtsdf
