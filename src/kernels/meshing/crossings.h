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
/// those directions that cross zero there; and the weight of all that have a say, at each end.
template <class Real>
struct CrossingWeights {
  Real product{0.0f}, lower{0.0f}, upper{0.0f};
};

/// The edge's lower end is corner `c`. Facing 0 is where `behind_below`.
template <class Samples, class Mask>
DTSDF_HD CrossingWeights<typename Samples::Real> weighCrossing(const Samples& samples, int c,
                                                               int axis, const Mask& behind_below) {
  using Real = typename Samples::Real;
  const Real zero{0.0f};
  CrossingWeights<Real> known;
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
    known.product = maximum(known.product, select(crosses, lower * upper, zero));
    known.lower = known.lower + select(speaks, lower, zero);
    known.upper = known.upper + select(speaks, upper, zero);
  }
  return known;
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
    const CrossingWeights<Real> known = weighCrossing(samples, c, axis, lower);
    const Real strength = maximum(known.product, by_vote * (known.lower * known.upper));
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
