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
/// where it crosses the neighbouring line of edges, so that they stay on it: on the edge beside
/// theirs, or on the one before or after that where the surface is slanted. Added across the two
/// ends of an edge, weights do not depend on where the surface crosses it: they fall linearly with
/// the distance.
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

/// Where a surface crosses a line of edges: how far from the lower end of the edge that was asked
/// for, in voxels, and the weight at both ends of the edge that it crosses.
struct LineCrossing {
  float offset;
  float weight;
};
constexpr float kNoCrossing = -9.0f;  ///< An offset that is far from any.

/// The crossing of the edge between samples 0 and 1 of a line, or of the one before or after it.
/// The weight is the edge's own if none is crossed.
template <class Line>
DTSDF_HD LineCrossing crossingNear(const Line& sample, int facing) {
  const Sample lower = sample(0), upper = sample(1);
  const auto between = [](const Sample& a, const Sample& b, float from) {
    return LineCrossing{from + a.sdf / (a.sdf - b.sdf), a.weight + b.weight};
  };
  if (crosses(lower, upper, facing)) return between(lower, upper, 0.0f);
  const Sample before = sample(-1);
  if (crosses(before, lower, facing)) return between(before, lower, -1.0f);
  const Sample after = sample(2);
  if (crosses(upper, after, facing)) return between(upper, after, 1.0f);
  return {kNoCrossing, lower.weight + upper.weight};
}

/// A line of corners through an edge.
template <class Corners>
struct CornerLine {
  const Corners& corners;
  GridEdge edge;
  int direction;

  DTSDF_HD Sample operator()(int i) const {
    Vec3i at = edge.corner;
    (edge.axis == 0 ? at.x : edge.axis == 1 ? at.y : at.z) += i;
    return corners.sample(at, direction);
  }
};

/// How far a vertex moves across its edge, and along it, in voxels.
struct BorderShift {
  float across, along;
};

/// A line of edges and those beside it along another axis.
struct LinesAcross {
  LineCrossing own, lower, upper;
};

/// Whether what was measured ends between the lines.
DTSDF_HD bool isBorder(const LinesAcross& lines) {
  const float own = lines.own.weight, lower = lines.lower.weight, upper = lines.upper.weight;
  return 2.0f * own < maximum(lower, upper) && minimum(lower, upper) <= own;
}

/// The shift of a vertex where it does. It stays on its edge's stretch: beyond, the surface crosses
/// other edges, and triangles would fold. A surface that rises by more than a voxel from one line
/// to the next is not the vertex's own. The part across is a multiple of 2^-12, so that blocks on
/// both sides of a face come to the very same place.
DTSDF_HD BorderShift borderShift(const MeshRules& rules, const LinesAcross& lines) {
  const bool to_lower = lines.lower.weight > lines.upper.weight;
  const LineCrossing inner = to_lower ? lines.lower : lines.upper;
  const float rise = inner.offset - lines.own.offset, steepness = fabsf(rise);
  if (steepness > 1.0f) return {0.0f, 0.0f};
  const float from_end = rise < 0.0f ? lines.own.offset : 1.0f - lines.own.offset;
  const float room = maximum(from_end - rules.vertex_margin, 0.0f);
  constexpr float kMostShare = 15.0f / 16.0f;  // so that triangles keep an area
  const float most = steepness > room ? kMostShare * room / steepness : kMostShare;
  const float covered = cubeRoot(2.0f * lines.own.weight / inner.weight);
  constexpr float kSteps = 4096.0f;
  const float share = static_cast<float>(floorToInt(
                          minimum(maximum(1.0f - covered, 0.0f), most) * kSteps)) / kSteps;
  return {to_lower ? -share : share, share * rise};
}

/// A vertex at `offset` on an edge, and the samples around: `line(direction, across, side)` is the
/// line through the edge (side 0), or beside it along the axis `across` (side -1 or 1).
template <class LineAt>
struct BorderVertex {
  const MeshRules& rules;
  const LineAt& line;
  int axis, facing;
  float offset;

  DTSDF_HD float weight(int direction) const {
    const auto own = line(direction, axis, 0);
    return own(0).weight + own(1).weight;
  }

  /// The direction that knows most of the edge, of those that have a say on it.
  DTSDF_HD int strongestDirection() const {
    int strongest = facedDirection(axis, facing);
    for (int d = 0; d < kDirectionCount; ++d) {
      if (speaksOnEdge(d, axis, facing) && weight(d) > weight(strongest)) strongest = d;
    }
    return strongest;
  }

  DTSDF_HD LinesAcross linesAcross(int direction, int across) const {
    return {{offset, weight(direction)},
            crossingNear(line(direction, across, -1), facing),
            crossingNear(line(direction, across, 1), facing)};
  }

  /// What the direction knows that the surface faces, decides; but it knows little where the edge
  /// runs along the surface, border or not: there the strongest direction has to end as well.
  DTSDF_HD BorderShift shift(int across) const {
    const int faced = facedDirection(axis, facing);
    const LinesAcross lines = linesAcross(faced, across);
    if (!isBorder(lines)) return {0.0f, 0.0f};
    const int strongest = strongestDirection();
    if (strongest != faced && !isBorder(linesAcross(strongest, across))) return {0.0f, 0.0f};
    return borderShift(rules, lines);
  }
};

/// The shifts of a vertex along the two axes across its edge, in their order.
struct BorderShifts {
  BorderShift first, second;
};

template <class LineAt>
DTSDF_HD BorderShifts borderShifts(const MeshRules& rules, const LineAt& line, int axis, int facing,
                                   float offset) {
  const BorderVertex<LineAt> vertex{rules, line, axis, facing, offset};
  return {vertex.shift(axis == 0 ? 1 : 0), vertex.shift(axis == 2 ? 1 : 2)};
}

/// A vertex on an edge along an axis, after its shifts. Where the border passes between both axes
/// across the edge, either shift alone would reach it: half of each is taken.
DTSDF_HD Vec3f shifted(const Vec3f& vertex, const BorderShifts& shifts, int axis) {
  const BorderShift a = shifts.first, b = shifts.second;
  if (a.across == 0.0f && b.across == 0.0f) return vertex;  // as nearly all
  const float share = a.across != 0.0f && b.across != 0.0f ? 0.5f : 1.0f;
  return vertex + (share * a.across) * toFloat(unitStep(axis == 0 ? 1 : 0)) +
         (share * b.across) * toFloat(unitStep(axis == 2 ? 1 : 2)) +
         (share * (a.along + b.along)) * toFloat(unitStep(axis));
}

/// The vertex of an edge, held to what was measured.
template <class Corners>
DTSDF_HD Vec3f heldToBorder(const MeshRules& rules, const Corners& corners, int edge,
                            const Vec3f& vertex) {
  const GridEdge at{cornerAt(edgeCorner(edge)), edgeAxis(edge), edgeFacing(edge)};
  const float offset = component(vertex, at.axis) - component(toFloat(at.corner), at.axis);
  const auto line = [&](int direction, int across, int side) {
    const Vec3i step = unitStep(across);
    return CornerLine<Corners>{
        corners, moved(at, {side * step.x, side * step.y, side * step.z}), direction};
  };
  return shifted(vertex, borderShifts(rules, line, at.axis, at.facing, offset), at.axis);
}

}  // namespace dtsdf
