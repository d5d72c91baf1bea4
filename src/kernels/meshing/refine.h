/// Optional refinement, which splits each triangle into four. The new vertices are the midpoints of
/// its sides, moved onto the curved surface.
///
/// The midpoint of a side is that of a cubic curve that is tangent to the surface at both ends of
/// the side (Vlachos et al., Curved PN Triangles, 2001). It depends only on the two ends and their
/// normals, so all triangles with this side share it, even across units and blocks. A side is
/// identified by the grid edges of its two ends.
#pragma once

#include "kernels/core/grid.h"
#include "kernels/meshing/emit.h"
#include "kernels/meshing/gap.h"
#include "kernels/meshing/mesh_tables.h"

namespace dtsdf {

/// Maximum number of triangle sides in a case: four loops of three edges have twelve sides.
constexpr int kMaxSides = 12;

/// The triangle sides of each marching cubes case, without duplicates, and the sides of each
/// triangle; derived at compile time from mesh_tables.h.
struct RefineTables {
  /// Sides of each case in the order of its triangles; a side is given by two of the unit's edges.
  uint8_t side_count[256];
  uint8_t side_edge[256][2 * kMaxSides];
  /// Indices of each triangle's sides; the first side runs from the first corner to the second.
  uint8_t triangle_side[256][3 * kMaxTriangles];
};

namespace refine_tables_detail {

/// Index of the side between two edges in a case; the side is added if it is new.
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

/// Does not compile with more sides than kMaxSides, as constant expressions cannot write past the
/// end of an array.
inline constexpr RefineTables kRefineTables = refine_tables_detail::make();

/// Triangles of the refined mesh per triangle of the plain mesh.
constexpr int kRefinedTriangles = 4;

static_assert(kGridEdges + kVoxelsPerBlock * kMaxSheets * kMaxSides <= 65536,
              "a block's vertex indices must fit in 16 bits");

/// BlockVertex::edge of the midpoint between the vertices of two edges, given in either order.
constexpr uint32_t kFirstMiddle = kGridEdges;
DTSDF_HD uint32_t midpointNumber(int edge_a, int edge_b) {
  const uint32_t a = static_cast<uint32_t>(edge_a < edge_b ? edge_a : edge_b);
  const uint32_t b = static_cast<uint32_t>(edge_a < edge_b ? edge_b : edge_a);
  return kFirstMiddle + a * kGridEdges + b;
}
DTSDF_HD bool isMidpoint(uint32_t number) { return number >= kFirstMiddle; }

/// The edges at the two ends of a midpoint's side, the lower index first.
DTSDF_HD int midpointFirstEnd(uint32_t number) {
  return static_cast<int>((number - kFirstMiddle) / kGridEdges);
}
DTSDF_HD int midpointSecondEnd(uint32_t number) {
  return static_cast<int>((number - kFirstMiddle) % kGridEdges);
}

/// Step along a vertex's edge, from behind the surface to its front; for a midpoint, the sum of the
/// steps of both ends.
DTSDF_HD Vec3i facingSteps(uint32_t number) {
  if (!isMidpoint(number)) return facingStep(static_cast<int>(number));
  return facingStep(midpointFirstEnd(number)) + facingStep(midpointSecondEnd(number));
}

/// A vertex at the end of a side, and its unit normal, which is 0 if unknown.
struct SideEnd {
  Vec3f position, normal;
};

/// Rounds to a multiple of 2^-16, so that the blocks on both sides of a face, whose coordinates
/// differ by whole blocks, put the midpoint at exactly the same position.
DTSDF_HD float roundedShift(float shift) {
  constexpr float kSteps = 65536.0f;
  return static_cast<float>(floorToInt(shift * kSteps + 0.5f)) / kSteps;
}

/// The midpoint of the curved side between two vertices; an end without a normal does not bend the
/// side. Swapping the ends gives exactly the same point. The midpoint is off the straight side by
/// at most a quarter of the side's length.
DTSDF_HD Vec3f midpointOfSide(const SideEnd& a, const SideEnd& b) {
  const Vec3f way = b.position - a.position;
  const Vec3f at_a = dot(way, a.normal) * a.normal, at_b = dot(way, b.normal) * b.normal;
  const Vec3f shift = 0.125f * (at_b - at_a);
  return 0.5f * (a.position + b.position) +
         Vec3f{roundedShift(shift.x), roundedShift(shift.y), roundedShift(shift.z)};
}

/// Number of triangle sides in a unit; sides shared by two triangles of a sheet count once.
DTSDF_HD uint32_t sidesOfUnit(const RefineTables& tables, const UnitIndices& indices) {
  uint32_t sides = 0;
  for (int s = 0; s < kMaxSheets; ++s) sides += tables.side_count[indices.sheet[s]];
  return sides;
}

/// Calls visit(a, b) for each side of a unit's triangles, with the edges of its two ends, in
/// canonical order.
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

/// Calls visit(vertex) for the corners of the four triangles that replace one; midpoint i follows
/// corner i.
template <class Visit>
DTSDF_HD void visitRefinedTriangle(const uint32_t (&corner)[3], const uint32_t (&middle)[3],
                                   const Visit& visit) {
  for (int k = 0; k < 3; ++k) {
    visit(corner[k]);
    visit(middle[k]);
    visit(middle[(k + 2) % 3]);
  }
  for (int k = 0; k < 3; ++k) visit(middle[k]);
}

/// Calls visit(vertex) for the corners of a unit's refined triangles, three per triangle, in
/// canonical order. `vertexOf` returns the vertex on an edge; the unit's midpoints start at
/// first_middle. If isGap() holds for a triangle's corners, its four triangles are marked as gaps.
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
        visitRefinedTriangle(corner, middle, visit);
      }
    }
    first_middle += refine_tables.side_count[index];
  }
}

}  // namespace dtsdf
