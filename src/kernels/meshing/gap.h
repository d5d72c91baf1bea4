/// Finds triangles that span a gap in the measurements.
///
/// A surfel updates all corners around it, so the mesh may close gaps up to two voxels wide.
/// Anchoring (anchoring.h) pulls the vertices on both sides of a gap towards measured points, and
/// thus away from each other. It hardly stretches other triangles: at an outline it pulls all
/// vertices in the same direction, and inside a surface the vertices stay in place. So triangles
/// that anchoring stretches are left out.
#pragma once

#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/mesh_rules.h"

namespace dtsdf {

/// A vertex's position without the component of its anchoring shift perpendicular to the edge. The
/// component along the edge is kept, as it is mostly perpendicular to the surface.
DTSDF_HD Vec3f placeOnEdge(const BlockVertex& vertex) {
  const int edge = static_cast<int>(vertex.edge);
  Vec3f place = toFloat(cornerAt(edgeCorner(edge)));
  const int axis = edgeAxis(edge);
  if (axis == 0) place.x = vertex.position.x;
  if (axis == 1) place.y = vertex.position.y;
  if (axis == 2) place.z = vertex.position.z;
  return place;
}

/// Whether a vertex was pulled by nearly half of max_stretch. Without such a vertex, a triangle
/// cannot span a gap. Branch-free, as the branch would be unpredictable.
DTSDF_HD bool isPulledFar(const MeshRules& rules, const BlockVertex& vertex) {
  const Vec3f shift = vertex.position - placeOnEdge(vertex);
  return dot(shift, shift) > 0.24f * rules.max_stretch * rules.max_stretch;
}

/// Length, in voxels, that anchoring adds to a triangle's side.
DTSDF_HD float stretchOf(const BlockVertex& a, const BlockVertex& b) {
  return norm(b.position - a.position) - norm(placeOnEdge(b) - placeOnEdge(a));
}

/// Whether the triangle of three vertices spans a gap.
DTSDF_HD bool spansGap(const MeshRules& rules, const BlockVertex& a, const BlockVertex& b,
                       const BlockVertex& c) {
  const bool may_be_gap = isPulledFar(rules, a) | isPulledFar(rules, b) | isPulledFar(rules, c);
  if (!may_be_gap) return false;  // most triangles; saves the square roots
  return stretchOf(a, b) > rules.max_stretch || stretchOf(b, c) > rules.max_stretch ||
         stretchOf(c, a) > rules.max_stretch;
}

/// Until it is removed, a triangle that spans a gap is marked by having this vertex at all three
/// corners. No other triangle contains a vertex twice.
constexpr uint16_t kGapVertex = 0;
DTSDF_HD bool isMarkedGap(const uint16_t* triangle) { return triangle[0] == triangle[1]; }

}  // namespace dtsdf
