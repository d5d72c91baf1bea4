/// Vertices held to what was measured.
///
/// A surfel updates the samples on the corners around it, and its plane goes on past the end of
/// what was seen: a surface that ends inside a cell has vertices up to a voxel beyond its end, and
/// where it curves out of sight they are off it. The anchors of an edge's ends (core/anchor.h) tell
/// where the surface was measured nearby: a vertex farther from there than
/// MeshRules::measured_reach is drawn to the nearest anchor, up to that distance. Inside a surface
/// anchors are near, and vertices stay where the distances put them.
///
/// Only the samples at the edge's two ends have a say, so all blocks that share an edge come to the
/// same vertex.
#pragma once

#include "kernels/meshing/edge_vertex.h"
#include "kernels/meshing/mesh_rules.h"

namespace dtsdf {

/// The anchor nearest to a vertex, from there, and how far that is, in voxels; none: negative.
struct NearestAnchor {
  Vec3f offset{0.0f, 0.0f, 0.0f};
  float distance = -1.0f;
};

DTSDF_HD void considerAnchor(NearestAnchor& nearest, uint16_t anchor,
                             const Vec3f& corner_from_vertex) {
  if (anchor == kNoAnchor) return;
  const Vec3f offset = corner_from_vertex + anchorOffset(anchor);
  const float distance = norm(offset);
  if (nearest.distance < 0.0f || distance < nearest.distance) nearest = {offset, distance};
}

/// The nearest of the anchors of those directions that tell an edge's crossing. `anchors(end,
/// direction)` gives that of the lower (0) or the upper end.
template <class Edge, class Anchors>
DTSDF_HD NearestAnchor nearestAnchor(const Edge& edge, const Anchors& anchors, int axis,
                                     int facing, float edge_offset) {
  const Vec3f along = toFloat(unitStep(axis));
  const bool is_crossed = isCrossedByAny(edge, axis, facing);
  NearestAnchor nearest;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!speaksOnEdge(d, axis, facing)) continue;
    const Sample lower = edge.lower[d], upper = edge.upper[d];
    if (is_crossed && !crosses(lower, upper, facing)) continue;
    if (lower.weight > 0.0f) considerAnchor(nearest, anchors(0, d), -edge_offset * along);
    if (upper.weight > 0.0f) considerAnchor(nearest, anchors(1, d), (1.0f - edge_offset) * along);
  }
  return nearest;
}

/// A multiple of 2^-12 voxels, so that blocks on both sides of a face come to the very same place.
DTSDF_HD float roundShift(float shift) {
  constexpr float kSteps = 4096.0f;
  return static_cast<float>(floorToInt(shift * kSteps + 0.5f)) / kSteps;
}

/// How a vertex is moved that lies at `edge_offset` on an edge, in voxels.
template <class Edge, class Anchors>
DTSDF_HD Vec3f anchoringShift(const MeshRules& rules, const Edge& edge, const Anchors& anchors,
                              int axis, int facing, float edge_offset) {
  const NearestAnchor nearest = nearestAnchor(edge, anchors, axis, facing, edge_offset);
  if (!(nearest.distance > rules.measured_reach)) return {0.0f, 0.0f, 0.0f};
  const float share = (nearest.distance - rules.measured_reach) / nearest.distance;
  return {roundShift(share * nearest.offset.x), roundShift(share * nearest.offset.y),
          roundShift(share * nearest.offset.z)};
}

}  // namespace dtsdf
