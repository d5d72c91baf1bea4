/// Vertices held to what was measured.
///
/// A surfel updates the samples on the corners around it, and its plane goes on past the end of
/// what was seen: a surface that ends inside a cell has vertices up to a voxel beyond its end, and
/// where it curves out of sight they are off it. The anchors of an edge's ends (core/anchor.h) tell
/// where the surface was measured nearby. Where it was not measured at the foot of one of the two
/// corners, the vertex is drawn to the nearest anchor, most of the way. Between feet that were
/// measured, vertices stay where the distances put them.
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

/// How far a corner's foot lies from where the surface was measured, in voxels: the least that it
/// can be, with an anchor that is a step higher than it says, since the root makes much of that.
/// Without an anchor it is as far as can be.
DTSDF_HD float footGap(uint16_t anchor, const Sample& sample) {
  if (anchor == kNoAnchor) return 2.0f * kAnchorReach;
  const Vec3f offset = anchorOffset(anchor);
  const float height = fabsf(sample.sdf) + 1.0f / kStepsPerVoxel;
  return sqrtf(maximum(dot(offset, offset) - height * height, 0.0f));
}

/// What the directions that tell an edge's crossing know of where it was measured.
struct MeasuredNearby {
  NearestAnchor nearest;
  float gap = 2.0f * kAnchorReach;  ///< Of the end whose foot is farther from it, in voxels.
};

/// `anchors(end, direction)` gives that of the lower (0) or the upper end.
template <class Edge, class Anchors>
DTSDF_HD MeasuredNearby measuredNearby(const Edge& edge, const Anchors& anchors, int axis,
                                       int facing, float edge_offset) {
  const Vec3f along = toFloat(unitStep(axis));
  const bool is_crossed = isCrossedByAny(edge, axis, facing);
  MeasuredNearby found;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!speaksOnEdge(d, axis, facing)) continue;
    const Sample lower = edge.lower[d], upper = edge.upper[d];
    if (is_crossed && !crosses(lower, upper, facing)) continue;
    const uint16_t at_lower = lower.weight > 0.0f ? anchors(0, d) : kNoAnchor;
    const uint16_t at_upper = upper.weight > 0.0f ? anchors(1, d) : kNoAnchor;
    considerAnchor(found.nearest, at_lower, -edge_offset * along);
    considerAnchor(found.nearest, at_upper, (1.0f - edge_offset) * along);
    const float gap = maximum(footGap(at_lower, lower), footGap(at_upper, upper));
    found.gap = minimum(found.gap, gap);
  }
  return found;
}

/// A multiple of 2^-12 voxels, so that blocks on both sides of a face come to the very same place.
DTSDF_HD float roundShift(float shift) {
  constexpr float kSteps = 4096.0f;
  return static_cast<float>(floorToInt(shift * kSteps + 0.5f)) / kSteps;
}

/// How a vertex at `edge_offset` on an edge is moved, in voxels.
template <class Edge, class Anchors>
DTSDF_HD Vec3f anchoringShift(const MeshRules& rules, const Edge& edge, const Anchors& anchors,
                              int axis, int facing, float edge_offset) {
  const auto [nearest, gap] = measuredNearby(edge, anchors, axis, facing, edge_offset);
  const float beyond = nearest.distance - rules.measured_gap;
  if (!(beyond > 0.0f && gap > rules.measured_gap)) return {0.0f, 0.0f, 0.0f};
  const float ramp = minimum(gap / rules.measured_gap - 1.0f, 1.0f);
  const float share = rules.measured_pull * ramp * beyond / nearest.distance;
  return {roundShift(share * nearest.offset.x), roundShift(share * nearest.offset.y),
          roundShift(share * nearest.offset.z)};
}

}  // namespace dtsdf
