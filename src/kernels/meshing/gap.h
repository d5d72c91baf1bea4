/// Gaps: where nothing was measured between the vertices of a triangle.
///
/// A surfel updates the samples on the corners around it, so a gap up to two voxels wide has
/// samples at all of its corners, and units that close it. Anchoring (anchoring.h) draws the
/// vertices on either side of it to where the surface was measured, and so apart. At an outline it
/// draws all of them to one side, nearer to each other; inside a surface they stay. So a triangle
/// that anchoring stretches stands in a gap, and is left out.
#pragma once

#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/mesh_rules.h"

namespace dtsdf {

/// Where the vertex of an edge was before it was drawn to an anchor, but for its way along the
/// edge: that leads across the surface, not along it.
DTSDF_HD Vec3f placeOnEdge(const BlockVertex& vertex) {
  const int edge = static_cast<int>(vertex.edge);
  Vec3f place = toFloat(cornerAt(edgeCorner(edge)));
  const int axis = edgeAxis(edge);
  if (axis == 0) place.x = vertex.position.x;
  if (axis == 1) place.y = vertex.position.y;
  if (axis == 2) place.z = vertex.position.z;
  return place;
}

/// Whether a vertex was drawn so far that a side of it can be too long: nearly half as far as the
/// side may be stretched. Branch-free, as no processor could predict the branch.
DTSDF_HD bool isDrawnFar(const MeshRules& rules, const BlockVertex& vertex) {
  const Vec3f shift = vertex.position - placeOnEdge(vertex);
  return dot(shift, shift) > 0.24f * rules.most_stretch * rules.most_stretch;
}

/// How much longer anchoring makes a side, in voxels.
DTSDF_HD float stretchOf(const BlockVertex& a, const BlockVertex& b) {
  return norm(b.position - a.position) - norm(placeOnEdge(b) - placeOnEdge(a));
}

/// Whether the triangle of three edges' vertices stands in a gap.
DTSDF_HD bool standsInGap(const MeshRules& rules, const BlockVertex& a, const BlockVertex& b,
                          const BlockVertex& c) {
  const bool may_be_gap = isDrawnFar(rules, a) | isDrawnFar(rules, b) | isDrawnFar(rules, c);
  if (!may_be_gap) return false;  // as most: no roots
  return stretchOf(a, b) > rules.most_stretch || stretchOf(b, c) > rules.most_stretch ||
         stretchOf(c, a) > rules.most_stretch;
}

/// In a block's list of triangles, one that stands in a gap has one vertex three times until it is
/// dropped: no other triangle has that.
constexpr uint16_t kGapVertex = 0;
DTSDF_HD bool isMarkedGap(const uint16_t* triangle) { return triangle[0] == triangle[1]; }

}  // namespace dtsdf
