/// Edge vertices, the second step of the make stage: where the surface crosses an edge of the
/// corner grid.
///
/// Between an edge's two samples the distance is taken to be a parabola instead of a line. With the
/// gradients g at its ends, f(t) = (1 - t) (a + g_a t / 2) + t (b + g_b (t - 1) / 2) is exact for
/// quadratic distances, as the errors of linear interpolation and of Taylor's cancel. Its root
/// takes only a square root. The gradients are central differences, which need samples one voxel
/// beyond the ends.
#pragma once

#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/possible_leaders.h"
#include "kernels/meshing/vote.h"

namespace dtsdf {

/// The direction of a surface that crosses an edge at a right angle. An undirected map's only array
/// (0) holds surfaces of any facing; on an edge it counts as this direction.
DTSDF_HD int facingDirection(int axis, int facing) { return 2 * axis + facing; }

// An Edge has members `lower` and `upper`, which give the sample of a direction at its two ends by
// []; beyond(end, direction) gives the sample one voxel beyond its lower (0) or upper (1) end.

/// The directions with a say on an edge: all but the one that faces against it.
DTSDF_HD uint32_t speakingOnEdge(int axis, int facing) {
  return kAllDirections & ~(1u << facingDirection(axis, 1 - facing));
}
DTSDF_HD bool speaksOnEdge(int direction, int axis, int facing) {
  return (speakingOnEdge(axis, facing) >> direction & 1u) != 0;
}

/// Offset of a vertex on an edge that no direction crosses by itself: it divides the edge by the
/// voted distances of its ends, in half if both are 0.
template <class Edge>
DTSDF_HD float votedOffset(const Edge& edge, int axis, int facing, float nearness) {
  CornerVote<float> lower, upper;
  visitDirections(speakingOnEdge(axis, facing), [&](int d) {
    const Sample a = edge.lower[d], b = edge.upper[d];
    castVote(lower, a.sdf, a.weight, true, nearness);
    castVote(upper, b.sdf, b.weight, true, nearness);
  });
  const float from_lower = fabsf(votedSdf(lower)), from_upper = fabsf(votedSdf(upper));
  return from_lower + from_upper > 0.0f ? from_lower / (from_lower + from_upper) : 0.5f;
}

/// Whether a direction's surface with the given facing crosses between two samples; facing 0: the
/// lower end is behind. Branch-free, as which directions cross is unpredictable.
DTSDF_HD bool crosses(const Sample& lower, const Sample& upper, int facing) {
  const bool behind_lower = facing == 0;
  return ((lower.sdf < 0.0f) == behind_lower) & ((upper.sdf < 0.0f) != behind_lower) &
         (lower.weight > 0.0f) & (upper.weight > 0.0f);
}

/// The directions that cross an edge by themselves, bit d for direction d, from the sides that all
/// directions see at the edge's ends (possible_leaders.h).
DTSDF_HD uint32_t crossingDirections(uint32_t lower_sides, uint32_t upper_sides, int axis,
                                     int facing) {
  const uint32_t behind = facing == 0 ? lower_sides : upper_sides;
  const uint32_t in_front = facing == 0 ? upper_sides : lower_sides;
  return (behind & ~in_front) >> kNegativeBit & observedDirections(in_front) &
         speakingOnEdge(axis, facing);
}

/// Change of the slope along an edge, per voxel: the mean of the known second differences at its
/// two ends, or 0. Limited to that of a ball of two voxels; more is noise or the fringe of another
/// surface.
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

/// Root of the parabola from a to b, of different signs, with this bend:
///   a + (b - a) t - bend t (1 - t) / 2 = 0
/// It is 0 if a is 0, even if the parabola returns to 0 before b: there the division would be 0 /
/// 0, and the NaN would spoil the mean over directions.
DTSDF_HD float zeroOfParabola(float a, float b, float bend) {
  if (a == 0.0f) return 0.0f;
  const float slope = b - a - 0.5f * bend;
  const float root = sqrtf(maximum(slope * slope - 2.0f * bend * a, 0.0f));
  return 2.0f * a / (a < 0.0f ? -slope - root : root - slope);
}

/// Vertices keep this share of an edge away from corners, so that no triangle is degenerate:
/// triangles that meet at a corner have sides of at least 2^-10 voxels, which single precision
/// resolves to one in 2000 even at the far end of a block (8 voxels, spacing 2^-21).
constexpr float kVertexMargin = 1.0f / 1024.0f;

/// Position of the surface on an edge, as a share from its lower end: the weighted mean of the zero
/// crossings of the directions with this facing (paper, Sec. V-D), each with the product of its two
/// weights. Facing 0: the lower end is behind. `crossing` is from crossingDirections().
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
