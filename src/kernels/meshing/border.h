/// The border of what was measured: vertices there are moved to where it ends.
///
/// A surfel updates the samples on the corners around it, so a surface that ends inside a cell has
/// vertices on the cell's far side, up to a voxel beyond its end. How far the measurements reached
/// into the cell shows in the weights: a surfel at u between two corners counts for them with
/// (1 - u)^2 and u^2. Where all up to u = x is covered, on the inner corner's other side too,
///
///   far weight / near weight = x^3 / (2 - (1 - x)^3), which is x^3 / 2 to within a few per cent
///
/// of x, so x = (2 r)^(1/3) for a ratio r below 1/2. Vertices are moved along the surface, towards
/// the one on the neighbouring edge, so that they stay on it. Added across the two ends of an edge,
/// weights do not depend on where the surface crosses it: they fall linearly with the distance.
/// They are those of the direction that tells the crossing: another one may end there, or go on.
#pragma once

#include <cstring>

#include "kernels/meshing/edge_vertex.h"
#include "kernels/meshing/mesh_rules.h"

namespace dtsdf {

/// An edge of the grid around a block, by its lower corner. Facing 0 is behind at the lower end.
struct GridEdge {
  Vec3i corner;
  int axis, facing;
};

DTSDF_HD Vec3i unitStep(int axis) {
  return {axis == 0 ? 1 : 0, axis == 1 ? 1 : 0, axis == 2 ? 1 : 0};
}

DTSDF_HD GridEdge moved(const GridEdge& edge, const Vec3i& by) {
  return {edge.corner + by, edge.axis, edge.facing};
}

/// Cube root by Newton's method, from a guess that is right to a few per cent: 0 for 0.
DTSDF_HD float cubeRoot(float a) {
  if (!(a > 0.0f)) return 0.0f;
  uint32_t bits;
  memcpy(&bits, &a, sizeof(bits));
  bits = bits / 3 + 0x2a514067u;  // a third of the exponent
  float x;
  memcpy(&x, &bits, sizeof(x));
  for (int i = 0; i < 3; ++i) x = (x + x + a / (x * x)) / 3.0f;
  return x;
}

/// Weight of a direction at both ends of an edge.
template <class Corners>
DTSDF_HD float edgeWeight(const Corners& corners, const GridEdge& edge, int direction) {
  return corners.sample(edge.corner, direction).weight +
         corners.sample(edge.corner + unitStep(edge.axis), direction).weight;
}

/// The samples at an edge's two ends. Those beyond count as unknown: the bend of the surface moves
/// a border hardly, and its vertices would depend on blocks farther away.
template <class Corners>
DTSDF_HD EdgeSamples edgeSamples(const Corners& corners, const GridEdge& edge) {
  EdgeSamples samples = {};
  for (int d = 0; d < kDirectionCount; ++d) {
    samples.lower[d] = corners.sample(edge.corner, d);
    samples.upper[d] = corners.sample(edge.corner + unitStep(edge.axis), d);
  }
  return samples;
}

/// The direction that tells a crossing: of those that cross the edge, the one with the greatest
/// product of its weights at the two ends; where none does, the one that the surface faces.
template <class Edge>
DTSDF_HD int tellingDirection(const Edge& samples, int axis, int facing) {
  int telling = facedDirection(axis, facing);
  float most = 0.0f;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!speaksOnEdge(d, axis, facing)) continue;
    const Sample a = samples.lower[d], b = samples.upper[d];
    const float product = a.weight * b.weight;
    if (crosses(a, b, facing) && product > most) {
      telling = d;
      most = product;
    }
  }
  return telling;
}

/// Where a surface crosses an edge, from its lower end; negative where none does.
template <class Corners>
DTSDF_HD float crossingOf(const MeshRules& rules, const Corners& corners, const GridEdge& edge) {
  const EdgeSamples samples = edgeSamples(corners, edge);
  bool is_crossed = false;
  for (int d = 0; d < kDirectionCount; ++d) {
    is_crossed = is_crossed || (speaksOnEdge(d, edge.axis, edge.facing) &&
                                crosses(samples.lower[d], samples.upper[d], edge.facing));
  }
  return is_crossed ? edgeOffset(rules, samples, edge.axis, edge.facing) : -1.0f;
}

/// How far a vertex moves across its edge, and along it, in voxels.
struct BorderShift {
  float across, along;
};

/// Whether a border passes between edges side by side, by the weights of an edge and of those below
/// and above it.
DTSDF_HD bool isAtBorder(float own, float lower, float upper) {
  const float inner = maximum(lower, upper), outer = minimum(lower, upper);
  return 2.0f * own < inner && outer <= own;
}

/// The weights of an edge and of those beside it along another axis.
struct WeightsAcross {
  float own, lower, upper;
};

template <class Corners>
DTSDF_HD WeightsAcross weightsAcross(const Corners& corners, const GridEdge& edge, int across,
                                     int direction) {
  const Vec3i step = unitStep(across);
  return {edgeWeight(corners, edge, direction),
          edgeWeight(corners, moved(edge, Vec3i{0, 0, 0} - step), direction),
          edgeWeight(corners, moved(edge, step), direction)};
}

DTSDF_HD bool isAtBorder(const WeightsAcross& weights) {
  return isAtBorder(weights.own, weights.lower, weights.upper);
}

/// The axes across an edge, the first and the second one.
DTSDF_HD int firstAcross(int axis) { return axis == 0 ? 1 : 0; }
DTSDF_HD int secondAcross(int axis) { return axis == 2 ? 1 : 2; }

/// Whether a border passes by an edge, as the direction knows that tells its crossing: nearly all
/// vertices are done with that.
template <class Corners>
DTSDF_HD bool isByBorder(const Corners& corners, const GridEdge& edge, int telling) {
  return isAtBorder(weightsAcross(corners, edge, firstAcross(edge.axis), telling)) ||
         isAtBorder(weightsAcross(corners, edge, secondAcross(edge.axis), telling));
}

/// Where the surface goes on inwards from a vertex at `offset` on an edge, from there, in voxels;
/// `across` is 0 where it does not. It crosses the edge beside, or, where it is too steep for that,
/// leads to one of the edges between the two.
template <class Corners>
DTSDF_HD BorderShift wayInward(const MeshRules& rules, const Corners& corners,
                               const GridEdge& edge, float offset, const Vec3i& inward,
                               int telling) {
  const float next = crossingOf(rules, corners, moved(edge, inward));
  if (!(next < 0.0f)) return {1.0f, next - offset};
  BorderShift way{0.0f, 0.0f};
  for (int end = 0; end < 2; ++end) {
    const Vec3i from = end == 0 ? edge.corner : edge.corner + unitStep(edge.axis);
    const Sample a = corners.sample(from, telling), b = corners.sample(from + inward, telling);
    if (!(crosses(a, b, 0) || crosses(a, b, 1))) continue;
    const float at = a.sdf / (a.sdf - b.sdf);
    if (way.across == 0.0f || at < way.across) way = {at, static_cast<float>(end) - offset};
  }
  return way;
}

/// The shift of the vertex at `offset` on an edge along another axis, to where the measurements of
/// the direction end that tells the crossing. The part across is a multiple of 2^-12, so that
/// blocks on both sides of a face come to the very same place.
template <class Corners>
DTSDF_HD BorderShift borderShift(const MeshRules& rules, const Corners& corners,
                                 const GridEdge& edge, float offset, int telling, int across) {
  const WeightsAcross weights = weightsAcross(corners, edge, across, telling);
  if (!isAtBorder(weights)) return {0.0f, 0.0f};
  const bool to_lower = weights.lower > weights.upper;
  const Vec3i step = unitStep(across), inward = to_lower ? Vec3i{0, 0, 0} - step : step;
  const BorderShift way = wayInward(rules, corners, edge, offset, inward, telling);
  if (!(way.across > 0.0f)) return {0.0f, 0.0f};
  constexpr float kSteps = 4096.0f;
  constexpr float kMostShare = 15.0f / 16.0f;  // of the way, so that triangles keep an area
  const float covered = cubeRoot(2.0f * weights.own / maximum(weights.lower, weights.upper));
  const float wanted = minimum(maximum(1.0f - covered, 0.0f), kMostShare * way.across);
  const float shift = static_cast<float>(floorToInt(wanted * kSteps)) / kSteps;
  return {to_lower ? -shift : shift, shift / way.across * way.along};
}

/// The vertex of an edge, held to what was measured. Where the border passes between both axes
/// across the edge, either shift alone would reach it: half of each is taken.
template <class Corners>
DTSDF_HD Vec3f heldToBorder(const MeshRules& rules, const Corners& corners, int edge,
                            const Vec3f& vertex) {
  const GridEdge at{cornerAt(edgeCorner(edge)), edgeAxis(edge), edgeFacing(edge)};
  const int telling = tellingDirection(edgeSamples(corners, at), at.axis, at.facing);
  const float offset = component(vertex, at.axis) - component(toFloat(at.corner), at.axis);
  const int first = firstAcross(at.axis), second = secondAcross(at.axis);
  const BorderShift a = borderShift(rules, corners, at, offset, telling, first);
  const BorderShift b = borderShift(rules, corners, at, offset, telling, second);
  if (a.across == 0.0f && b.across == 0.0f) return vertex;
  const float share = a.across != 0.0f && b.across != 0.0f ? 0.5f : 1.0f;
  return vertex + (share * a.across) * toFloat(unitStep(first)) +
         (share * b.across) * toFloat(unitStep(second)) +
         (share * (a.along + b.along)) * toFloat(unitStep(at.axis));
}

}  // namespace dtsdf
