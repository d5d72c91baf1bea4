/// Edge vertices: where the surface crosses an edge of the corner grid.
///
/// The distance along an edge is modelled as a parabola. Its second difference is the mean of the
/// second differences at the edge's two ends (bendOnEdge()), which need the samples one voxel
/// beyond the ends.
#pragma once

#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/possible_leaders.h"
#include "kernels/meshing/vote.h"

namespace dtsdf {

/// The direction whose axis points along an edge from its end behind the surface to its end in
/// front. The only array (0) of an undirected map is treated as this direction.
DTSDF_HD int facingDirection(int axis, int facing) { return 2 * axis + facing; }

// An Edge provides lower[d] and upper[d], the samples of direction d at its two ends, and
// beyond(end, d), the sample one voxel beyond the lower (0) or upper (1) end.

/// The directions that are used on an edge: all except the direction whose axis points along the
/// edge from its end in front of the surface to its end behind it.
DTSDF_HD uint32_t directionsOnEdge(int axis, int facing) {
  return kAllDirections & ~(1u << facingDirection(axis, 1 - facing));
}
DTSDF_HD bool countsOnEdge(int direction, int axis, int facing) {
  return (directionsOnEdge(axis, facing) >> direction & 1u) != 0;
}

/// Offset of a vertex on an edge that no direction crosses by itself: the edge is divided in the
/// ratio of the magnitudes of the voted distances at its ends, or in the middle if both are 0.
template <class Edge>
DTSDF_HD float votedOffset(const Edge& edge, int axis, int facing, float nearness) {
  CornerVote<float> lower, upper;
  visitDirections(directionsOnEdge(axis, facing), [&](int d) {
    const Sample a = edge.lower[d], b = edge.upper[d];
    castVote(lower, a.sdf, a.weight, true, nearness);
    castVote(upper, b.sdf, b.weight, true, nearness);
  });
  const float from_lower = fabsf(votedSdf(lower)), from_upper = fabsf(votedSdf(upper));
  return from_lower + from_upper > 0.0f ? from_lower / (from_lower + from_upper) : 0.5f;
}

/// Whether a direction's distance crosses zero between two known samples, with the given facing (0:
/// the lower end is behind). Branch-free, since a branch would be unpredictable.
DTSDF_HD bool crosses(const Sample& lower, const Sample& upper, int facing) {
  const bool behind_lower = facing == 0;
  return ((lower.sdf < 0.0f) == behind_lower) & ((upper.sdf < 0.0f) != behind_lower) &
         (lower.weight > 0.0f) & (upper.weight > 0.0f);
}

/// The directions in directionsOnEdge() that cross an edge by themselves, bit d for direction d.
/// The arguments are the sidesOfCorner() of the edge's two ends (possible_leaders.h).
DTSDF_HD uint32_t crossingDirections(uint32_t lower_sides, uint32_t upper_sides, int axis,
                                     int facing) {
  const uint32_t behind = facing == 0 ? lower_sides : upper_sides;
  const uint32_t in_front = facing == 0 ? upper_sides : lower_sides;
  return (behind & ~in_front) >> kNegativeBit & observedDirections(in_front) &
         directionsOnEdge(axis, facing);
}

/// Second difference of the distance along an edge: the mean of the second differences at its two
/// ends, or the only known one; 0 if neither is known. It is limited to the second difference of a
/// ball with a radius of two voxels; larger values usually come from noise or from the fringe of
/// another surface.
DTSDF_HD float bendOnEdge(const Sample& below, const Sample& lower, const Sample& upper,
                          const Sample& above) {
  constexpr float kMaxBend = 0.5f;
  const float at_lower = below.sdf - 2.0f * lower.sdf + upper.sdf;
  const float at_upper = lower.sdf - 2.0f * upper.sdf + above.sdf;
  const bool knows_lower = below.weight > 0.0f, knows_upper = above.weight > 0.0f;
  float bend = knows_lower ? at_lower : 0.0f;
  if (knows_upper) bend = knows_lower ? 0.5f * (bend + at_upper) : at_upper;
  return minimum(maximum(bend, -kMaxBend), kMaxBend);
}

/// Zero of the parabola with this bend from a (at t = 0) to b (at t = 1), which have different
/// signs:
///   a + (b - a) t - bend t (1 - t) / 2 = 0
/// It is 0 if a is 0, where the formula may divide 0 by 0.
DTSDF_HD float zeroOfParabola(float a, float b, float bend) {
  if (a == 0.0f) return 0.0f;
  const float slope = b - a - 0.5f * bend;
  const float root = sqrtf(maximum(slope * slope - 2.0f * bend * a, 0.0f));
  return 2.0f * a / (a < 0.0f ? -slope - root : root - slope);
}

/// Minimum distance, in voxels, of a vertex from the ends of its edge (before anchoring), so that
/// vertices of different edges do not coincide. Large enough for single precision anywhere in a
/// block.
constexpr float kVertexMargin = 1.0f / 1024.0f;

/// Distance in voxels of the vertex on an edge from the lower end: the mean of the zero crossings
/// of the directions in `crossing`, each weighted by the product of the weights at the two ends
/// (paper, Sec. V-D), or votedOffset() if there are none. At least kVertexMargin from either end.
/// `facing` is 0 if the lower end is behind.
template <class Edge>
DTSDF_HD float edgeOffset(const MeshRules& rules, const Edge& edge, uint32_t crossing, int axis,
                          int facing) {
  float sum = 0.0f, sum_weight = 0.0f;
  visitDirections(crossing, [&](int d) {
    const Sample a = edge.lower[d], b = edge.upper[d];
    const float weight = a.weight * b.weight;
    const float bend = bendOnEdge(edge.beyond(0, d), a, b, edge.beyond(1, d));
    sum += weight * zeroOfParabola(a.sdf, b.sdf, bend);
    sum_weight += weight;
  });
  const float offset =
      sum_weight > 0.0f ? sum / sum_weight : votedOffset(edge, axis, facing, rules.nearness_voxels);
  return minimum(maximum(offset, kVertexMargin), 1.0f - kVertexMargin);
}

/// Position of an edge's vertex in voxels, relative to the block's first voxel.
DTSDF_HD Vec3f vertexPosition(int edge, float offset) {
  const Vec3i corner = cornerAt(edgeCorner(edge));
  const int axis = edgeAxis(edge);
  Vec3f p = toFloat(corner);
  if (axis == 0) p.x += offset;
  if (axis == 1) p.y += offset;
  if (axis == 2) p.z += offset;
  return p;
}

}  // namespace dtsdf
