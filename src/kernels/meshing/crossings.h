/// Which crossings of a sheet are known too little to be meshed.
///
/// Where a sheet crosses an edge, it is told by the directions that cross zero there themselves.
/// Elsewhere corners of different directions meet: past the end of one surface begins what the
/// fringe of another one says, and vertices between the two are off by half a voxel.
#pragma once

#include "kernels/meshing/mesh_rules.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// How much is known of a crossing: the greatest product of the weights at an edge's two ends, of
/// those directions that cross zero there; or the product of the weights of all that have a say, of
/// which so large a share counts. The edge's lower end is corner `c`. Facing 0 is where
/// `behind_below`.
template <class Samples, class Mask, class Real>
DTSDF_HD Real weighCrossing(const Samples& samples, int c, int axis, const Mask& behind_below,
                            const Real& voted_share) {
  const Real zero{0.0f};
  Real greatest = zero, all_lower = zero, all_upper = zero;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!samples.isObserved(d)) continue;
    const Real lower = samples.weight(d, c), upper = samples.weight(d, c | 1 << axis);
    const auto lower_behind = samples.sdf(d, c) < zero;
    const auto upper_behind = samples.sdf(d, c | 1 << axis) < zero;
    const auto any_facing = zero >= zero;
    // The direction that faces against the sheet has no say.
    const auto speaks = directionAxis(d) != axis
                            ? any_facing
                            : ((d & 1) == 0 ? behind_below : behind_below != any_facing);
    const auto crosses = speaks & (lower_behind == behind_below) & (upper_behind != behind_below);
    greatest = maximum(greatest, select(crosses, lower * upper, zero));
    all_lower = all_lower + select(speaks, lower, zero);
    all_upper = all_upper + select(speaks, upper, zero);
  }
  return maximum(greatest, voted_share * (all_lower * all_upper));
}

/// Crossings of a sheet with the given labels that are too weak, for each axis a bit by the edge's
/// lower corner: bit 8 * axis + corner. `greatest` is the greatest weight in the unit.
template <class Samples, class Bits, class Real>
DTSDF_HD Bits weakCrossings(const MeshRules& rules, const Samples& samples, const Bits& labels,
                            const Real& greatest) {
  const Bits none{0};
  const Real least = Real{rules.least_crossing_share} * greatest;
  const Real by_vote{rules.voted_crossing_share * rules.voted_crossing_share};
  Bits weak = none;
  for (int e = 0; e < kCubeEdges; ++e) {
    const int axis = e / 4, c = edgeLowerCorner(e);
    const auto lower = (labels & Bits{1 << c}) != none;
    const auto upper = (labels & Bits{1 << (c | 1 << axis)}) != none;
    const auto crossed = lower != upper;
    if (!any(crossed)) continue;
    const Real strength = weighCrossing(samples, c, axis, lower, by_vote);
    const auto is_weak = crossed & (least * least >= strength);
    weak = weak | select(is_weak, Bits{1 << (8 * axis + c)}, none);
  }
  return weak;
}

/// Whether a component crosses one of the edges.
DTSDF_HD bool crossesAny(uint8_t component, unsigned edges) {
  unsigned crossed = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const ParallelCrossings crossings = parallelCrossings(component, axis);
    crossed |= static_cast<unsigned>(crossings.rising | crossings.falling) << (8 * axis);
  }
  return (crossed & edges) != 0;
}

}  // namespace dtsdf
