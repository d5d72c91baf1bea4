/// Vertices held to what was measured.
///
/// A surfel updates the samples on the corners around it, and its plane goes on past the end of
/// what was seen: a surface that ends inside a cell has vertices up to a voxel beyond its end, and
/// where it curves out of sight they are off it. The anchors of an edge's ends (core/anchor.h) tell
/// where the surface was measured nearby. Where it was not measured at the foot of one of the two
/// corners, or where the vertex is not on the planes whose distances they hold (thin parts are seen
/// from many sides, and means of such distances cross where no surface is), the vertex is drawn to
/// the nearest anchor, most of the way. Other vertices stay where the distances put them.
///
/// Only the samples at the edge's two ends have a say, so all blocks that share an edge come to the
/// same vertex.
#pragma once

#include "kernels/meshing/edge_vertex.h"
#include "kernels/meshing/mesh_rules.h"

namespace dtsdf {

/// How far a corner's foot lies from where the surface was measured, in voxels, squared: the least
/// that it can be, with an anchor that is a step higher than it says, since the root makes much of
/// that; below 0 where that can be at the foot. Without an anchor it is as far as can be.
DTSDF_HD float squaredFootGap(uint16_t anchor, const Sample& sample) {
  if (anchor == kNoAnchor) return 4.0f * kAnchorReach * kAnchorReach;
  const Vec3f offset = anchorOffset(anchor);
  const float height = fabsf(sample.sdf) + 1.0f / kStepsPerVoxel;
  return dot(offset, offset) - height * height;
}

/// How far a vertex is off the plane that a corner's distance is of, in voxels, squared, where it
/// is nearer to the corner than that plane; else below 0. `along` is its way from the corner.
DTSDF_HD float squaredPlaneGap(const Sample& sample, float along) {
  const float height = maximum(fabsf(sample.sdf) - 1.0f / kStepsPerVoxel, 0.0f);
  return height * height - along * along;
}

/// Calls visit(direction, anchor at the lower end, anchor at the upper end) for the directions that
/// tell an edge's crossing. `anchors(end, direction)` gives that of the lower (0) or the upper end.
template <class Edge, class Anchors, class Visit>
DTSDF_HD void visitAnchors(const Edge& edge, uint32_t telling, const Anchors& anchors,
                           const Visit& visit) {
  visitDirections(telling, [&](int d) {
    visit(d, edge.lower[d].weight > 0.0f ? anchors(0, d) : kNoAnchor,
          edge.upper[d].weight > 0.0f ? anchors(1, d) : kNoAnchor);
  });
}

/// How far a vertex is from what was measured, in voxels: by the end of its edge that knows less,
/// of the crossing direction that knows best. Where none crosses it is on no plane.
template <class Edge, class Anchors>
DTSDF_HD float measuredGap(const MeshSettings& rules, const Edge& edge, uint32_t crossing,
                           const Anchors& anchors, float edge_offset) {
  const auto squaredGap = [&](uint16_t anchor, const Sample& sample, float along) {
    const float foot = squaredFootGap(anchor, sample);
    return rules.distances_to_planes ? maximum(foot, squaredPlaneGap(sample, along)) : foot;
  };
  float squared = 4.0f * kAnchorReach * kAnchorReach;
  visitAnchors(edge, crossing, anchors, [&](int d, uint16_t at_lower, uint16_t at_upper) {
    squared = minimum(squared, maximum(squaredGap(at_lower, edge.lower[d], edge_offset),
                                       squaredGap(at_upper, edge.upper[d], 1.0f - edge_offset)));
  });
  return sqrtf(maximum(squared, 0.0f));
}

/// A multiple of 2^-12 voxels, so that blocks on both sides of a face come to the very same place.
DTSDF_HD float roundShift(float shift) {
  constexpr float kSteps = 4096.0f;
  return static_cast<float>(floorToInt(shift * kSteps + 0.5f)) / kSteps;
}

/// How a vertex at `edge_offset` on an edge is moved, in voxels. Where no direction crosses the
/// edge on its own, the vote of all that have a say decides, and so they tell.
template <class Edge, class Anchors>
DTSDF_HD Vec3f anchoringShift(const MeshSettings& rules, const Edge& edge, uint32_t crossing,
                              const Anchors& anchors, int axis, int facing, float edge_offset) {
  const float gap = measuredGap(rules, edge, crossing, anchors, edge_offset);
  if (!(gap > rules.measured_gap)) return {0.0f, 0.0f, 0.0f};  // as most
  const uint32_t telling = crossing != 0 ? crossing : speakingOnEdge(axis, facing);
  const Vec3f along = toFloat(unitStep(axis));
  Vec3f nearest{0.0f, 0.0f, 0.0f};  // anchor, from the vertex
  float least_distance = -1.0f;     // none
  const auto consider = [&](uint16_t anchor, const Vec3f& corner_from_vertex) {
    if (anchor == kNoAnchor) return;
    const Vec3f offset = corner_from_vertex + anchorOffset(anchor);
    const float distance = norm(offset);
    if (!(least_distance < 0.0f || distance < least_distance)) return;
    nearest = offset;
    least_distance = distance;
  };
  visitAnchors(edge, telling, anchors, [&](int, uint16_t at_lower, uint16_t at_upper) {
    consider(at_lower, -edge_offset * along);
    consider(at_upper, (1.0f - edge_offset) * along);
  });
  const float beyond = least_distance - rules.measured_reach;
  if (!(beyond > 0.0f)) return {0.0f, 0.0f, 0.0f};
  const float ramp = minimum(gap / rules.measured_gap - 1.0f, 1.0f);
  const float share = rules.measured_pull * ramp * beyond / least_distance;
  return {roundShift(share * nearest.x), roundShift(share * nearest.y),
          roundShift(share * nearest.z)};
}

}  // namespace dtsdf
