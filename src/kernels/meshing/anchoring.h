/// Pulls vertices towards points where the surface was measured.
///
/// A surfel's plane continues past the end of what was measured, so a surface that ends inside a
/// cell has vertices up to a voxel beyond its end. If a thin part was measured from many sides, the
/// mean distances may cross zero where there is no surface. So a vertex with a large gap
/// (measuredGap()) is pulled towards the nearest anchor at the ends of its edge (core/anchor.h).
///
/// The shift depends only on the vertex and on samples at the edge's two ends, so all blocks that
/// share the edge compute the same shift.
#pragma once

#include "kernels/meshing/edge_vertex.h"
#include "kernels/meshing/mesh_rules.h"

namespace dtsdf {

/// Squared distance, in squared voxels, along the surface from a corner's foot (the surface point
/// nearest to it) to its anchor, minus an allowance for the rounding of stored values; may be
/// negative. 4 if there is no anchor.
DTSDF_HD float squaredFootGap(uint16_t anchor, const Sample& sample) {
  if (anchor == kNoAnchor) return 4.0f * kAnchorReach * kAnchorReach;
  const Vec3f offset = anchorOffset(anchor);
  const float height = fabsf(sample.sdf) + 1.0f / kStepsPerVoxel;
  return dot(offset, offset) - height * height;
}

/// Squared gap, in squared voxels, between a vertex and the plane at a corner's distance from the
/// corner, minus the allowance of squaredFootGap(). `along` is the vertex's distance from the
/// corner. Negative if the vertex is farther from the corner than the plane is.
DTSDF_HD float squaredPlaneGap(const Sample& sample, float along) {
  const float height = maximum(fabsf(sample.sdf) - 1.0f / kStepsPerVoxel, 0.0f);
  return height * height - along * along;
}

/// Calls visit(direction, anchor at the lower end, anchor at the upper end) for each direction in
/// the mask `telling`; an end without a known sample has kNoAnchor. `anchors(end, direction)`
/// returns the anchor at the lower (0) or upper (1) end.
template <class Edge, class Anchors, class Visit>
DTSDF_HD void visitAnchors(const Edge& edge, uint32_t telling, const Anchors& anchors,
                           const Visit& visit) {
  visitDirections(telling, [&](int d) {
    visit(d, edge.lower[d].weight > 0.0f ? anchors(0, d) : kNoAnchor,
          edge.upper[d].weight > 0.0f ? anchors(1, d) : kNoAnchor);
  });
}

/// The gap between a vertex and what was measured, in voxels. For a direction that crosses zero on
/// the edge, it is the larger of the gaps at the edge's two ends. The result is the smallest of
/// these, or 2 if no direction crosses zero on the edge.
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

/// Rounds to a multiple of 2^-12 voxels, so that the blocks on both sides of a face put a vertex at
/// exactly the same position.
DTSDF_HD float roundShift(float shift) {
  constexpr float kSteps = 4096.0f;
  return static_cast<float>(floorToInt(shift * kSteps + 0.5f)) / kSteps;
}

/// Shift of the vertex at `edge_offset` on an edge, in voxels; 0 if its gap is small. If no
/// direction's distance changes sign on the edge, the anchors of all directions in
/// directionsOnEdge() are used.
template <class Edge, class Anchors>
DTSDF_HD Vec3f anchoringShift(const MeshSettings& rules, const Edge& edge, uint32_t crossing,
                              const Anchors& anchors, int axis, int facing, float edge_offset) {
  const float gap = measuredGap(rules, edge, crossing, anchors, edge_offset);
  if (!(gap > rules.measured_gap)) return {0.0f, 0.0f, 0.0f};  // most vertices
  const uint32_t telling = crossing != 0 ? crossing : directionsOnEdge(axis, facing);
  const Vec3f along = toFloat(unitStep(axis));
  Vec3f nearest{0.0f, 0.0f, 0.0f};  // from the vertex to the anchor
  float min_distance = -1.0f;       // negative until an anchor is found
  const auto consider = [&](uint16_t anchor, const Vec3f& corner_from_vertex) {
    if (anchor == kNoAnchor) return;
    const Vec3f offset = corner_from_vertex + anchorOffset(anchor);
    const float distance = norm(offset);
    if (!(min_distance < 0.0f || distance < min_distance)) return;
    nearest = offset;
    min_distance = distance;
  };
  visitAnchors(edge, telling, anchors, [&](int, uint16_t at_lower, uint16_t at_upper) {
    consider(at_lower, -edge_offset * along);
    consider(at_upper, (1.0f - edge_offset) * along);
  });
  const float beyond = min_distance - rules.measured_reach;
  if (!(beyond > 0.0f)) return {0.0f, 0.0f, 0.0f};
  const float ramp = minimum(gap / rules.measured_gap - 1.0f, 1.0f);
  const float share = rules.measured_pull * ramp * beyond / min_distance;
  return {roundShift(share * nearest.x), roundShift(share * nearest.y),
          roundShift(share * nearest.z)};
}

}  // namespace dtsdf
