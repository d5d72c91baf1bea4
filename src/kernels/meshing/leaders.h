/// Finds the directions that are active in a mesh unit (see directionConfidence()), and those that
/// lead its sheets (see findLeaders()).
#pragma once

#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// Rise of a direction's distance along an axis: the weighted mean over the unit's edges whose ends
/// are both known; 0 if there are no such edges.
template <class Samples, class Real>
DTSDF_HD Real riseAlong(const Samples& samples, int direction, int axis, const Real& min_weight) {
  const Real zero{0.0f};
  Real rise = zero, total = zero;
  for (int c = 0; c < kCubeCorners; ++c) {
    if (c >> axis & 1) continue;
    const int upper = c | 1 << axis;
    const Real weight_c = samples.weight(direction, c);
    const Real weight_upper = samples.weight(direction, upper);
    const auto known = (weight_c > min_weight) & (weight_upper > min_weight);
    const Real weight = weight_c + weight_upper;
    const Real step = samples.sdf(direction, upper) - samples.sdf(direction, c);
    rise = rise + select(known, weight * step, zero);
    total = total + select(known, weight, zero);
  }
  return select(total > zero, rise / total, zero);
}

/// Confidence in a direction's surface in a unit; 0 if the direction is not active. An active
/// direction has samples on both sides of the surface (or a surface that touches a corner), and the
/// gradient of its distance is less than 67.5 degrees off its axis (the gradient check of the
/// paper's intra-directional filter). The gradient's length is ignored, as noise shortens it.
template <class Samples, class Real>
DTSDF_HD Real directionConfidence(const Samples& samples, int direction, const Real& min_weight) {
  const Real zero{0.0f};
  Real weight = zero;
  auto in_front = zero > zero, behind = in_front;
  for (int c = 0; c < kCubeCorners; ++c) {
    const Real corner_weight = samples.weight(direction, c), sdf = samples.sdf(direction, c);
    const auto known = corner_weight > min_weight;
    weight = weight + select(known, corner_weight, zero);
    behind = behind | (known & (sdf < Real{kTouching}));
    in_front = in_front | (known & (sdf >= Real{-kTouching}));
  }
  const auto sees_both = in_front & behind;
  if (!any(sees_both)) return zero;
  const Real rise[3] = {riseAlong(samples, direction, 0, min_weight),
                        riseAlong(samples, direction, 1, min_weight),
                        riseAlong(samples, direction, 2, min_weight)};
  const Real length = squareRoot(rise[0] * rise[0] + rise[1] * rise[1] + rise[2] * rise[2]);
  const Real cosine = rise[directionAxis(direction)] * Real{directionSign(direction)} / length;
  return select(sees_both & (length > zero) & (cosine > Real{kDirectionThreshold}), weight * cosine,
                zero);
}

/// Finds the directions that lead the unit's sheets; -1 for a missing sheet. The strongest
/// direction leads the first sheet (in case of a tie, the direction with the lowest index). Its
/// opposite leads the second sheet if it is active as well.
/// @return The active directions, bit d for direction d.
template <class Samples, class Real, class Bits>
DTSDF_HD Bits findLeaders(const Samples& samples, const Real& min_weight,
                          Bits (&leader)[kMaxSheets]) {
  const Real zero{0.0f};
  const Bits none{0};
  Bits active = none;
  Real confidence[kDirectionCount], greatest = zero;
  leader[0] = leader[1] = Bits{-1};
  for (int d = 0; d < kDirectionCount; ++d) {
    confidence[d] = zero;  // `? :` would copy vectors in halves, which stalls
    if (samples.mayBeActive(d)) confidence[d] = directionConfidence(samples, d, min_weight);
    const auto leads = confidence[d] > greatest;
    active = active | select(confidence[d] > zero, Bits{1 << d}, none);
    leader[0] = select(leads, Bits{d}, leader[0]);
    greatest = select(leads, confidence[d], greatest);
  }
  for (int d = 0; d < kDirectionCount; ++d) {
    const auto opposes = (confidence[d] > zero) & (leader[0] == Bits{d ^ 1});
    leader[1] = select(opposes, Bits{d}, leader[1]);
  }
  return active;
}

}  // namespace dtsdf
