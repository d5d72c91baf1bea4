/// Finds crossings, that is, edges with ends on different sides of a sheet (a surface in a mesh
/// unit), whose weights are too small for the sheet to be meshed.
///
/// Where one surface ends and the fringe of another begins, an edge may have one end behind the
/// first surface and the other in front of the second, although no direction's distance crosses
/// zero on it. A vertex there would be off by half a voxel.
#pragma once

#include "kernels/meshing/mesh_rules.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// Whether a direction is used at a crossing: true unless its axis points along the edge from the
/// end in front of the surface to the end behind it. `behind_below` is true if the edge's lower end
/// is behind.
template <class Mask>
DTSDF_HD Mask countsOnCrossing(int direction, int axis, const Mask& behind_below) {
  const Mask any_facing = behind_below == behind_below;
  if (directionAxis(direction) != axis) return any_facing;
  return (direction & 1) == 0 ? behind_below : behind_below != any_facing;
}

/// Weight of a crossing: the greatest product of the weights at the edge's two ends, over the
/// directions that cross zero there and for which countsOnCrossing() holds; 0 if there are none.
/// The edge's lower end is corner `c`.
template <class Real, class Samples, class Mask>
DTSDF_HD Real crossingWeight(const Samples& samples, int c, int axis, const Mask& behind_below) {
  const Real zero{0.0f};
  Real greatest = zero;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!samples.mayBeActive(d)) continue;  // it cannot cross zero
    const auto crosses = countsOnCrossing(d, axis, behind_below) &
                         ((samples.sdf(d, c) < zero) == behind_below) &
                         ((samples.sdf(d, c | 1 << axis) < zero) != behind_below);
    const Real product = samples.weight(d, c) * samples.weight(d, c | 1 << axis);
    greatest = maximum(greatest, select(crosses, product, zero));
  }
  return greatest;
}

/// The product of the weights at the edge's two ends, each summed over all directions for which
/// countsOnCrossing() holds.
template <class Real, class Samples, class Mask>
DTSDF_HD Real votedWeight(const Samples& samples, int c, int axis, const Mask& behind_below) {
  const Real zero{0.0f};
  Real lower = zero, upper = zero;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!samples.isObserved(d)) continue;
    const auto counts = countsOnCrossing(d, axis, behind_below);
    lower = lower + select(counts, samples.weight(d, c), zero);
    upper = upper + select(counts, samples.weight(d, c | 1 << axis), zero);
  }
  return lower * upper;
}

/// The weak crossings of a sheet, as a mask: bit 8 * axis + lower corner for each edge.
/// @param labels The corners behind the sheet, bit c for corner c. @param greatest Greatest weight
/// in the unit.
template <class Samples, class Bits, class Real>
DTSDF_HD Bits weakCrossings(const MeshRules& rules, const Samples& samples, const Bits& labels,
                            const Real& greatest) {
  const Bits none{0};
  const Real least = Real{rules.min_crossing_share} * greatest;
  const Real by_vote{rules.voted_crossing_share * rules.voted_crossing_share};
  Bits weak = none;
  for (int e = 0; e < kCubeEdges; ++e) {
    const int axis = e / 4, c = edgeLowerCorner(e);
    const auto lower = (labels & Bits{1 << c}) != none;
    const auto upper = (labels & Bits{1 << (c | 1 << axis)}) != none;
    const auto crossed = lower != upper;
    if (!any(crossed)) continue;
    auto is_weak = crossed & (least * least >= crossingWeight<Real>(samples, c, axis, lower));
    if (!any(is_weak)) continue;  // true for most units
    is_weak = is_weak & (least * least >= by_vote * votedWeight<Real>(samples, c, axis, lower));
    weak = weak | select(is_weak, Bits{1 << (8 * axis + c)}, none);
  }
  return weak;
}

}  // namespace dtsdf
