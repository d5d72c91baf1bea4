/// Which directions can lead a sheet in a unit, from the sides of its corners alone: so that the
/// index stage need not look at units that hold no surface.
///
/// The rule only rejects what the others would reject. A sheet that is not empty has a leader L
/// such that, for any MeshRules (a share of weight is never negative):
/// - L speaks: it has observed corners on both sides of a surface (directionConfidence).
/// - On each corner there is a vote of some direction other than the opposite of L, the one that
///   does not take part (voteOnCorners). So L is no leader if some corner was observed by no
///   direction, or by the opposite of L only.
/// A unit without such a direction has the indices 0. The same holds of the undirected map: its
/// only direction has to have observed all corners, and both sides.
#pragma once

#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// How a corner is seen: in front (bit d) and behind (bit 8 + d) by direction d; and which
/// directions can lead no sheet around it (bit 16 + d). The sides of a unit are those of its
/// corners, joined by a bitwise or. For a single corner, bit 24 + d tells whose distance is
/// negative.
constexpr int kBehindBit = 8, kBarredBit = 16, kNegativeBit = 24;

/// The sides that one direction's sample shows; both where the surface touches the corner.
DTSDF_HD uint32_t sidesOfSample(int direction, float sdf, float weight) {
  const uint32_t in_front = sdf >= -kTouching ? 1u << direction : 0u;
  const uint32_t behind = sdf < kTouching ? 1u << (kBehindBit + direction) : 0u;
  const uint32_t negative = sdf < 0.0f ? 1u << (kNegativeBit + direction) : 0u;
  return weight > 0.0f ? in_front | behind | negative : 0u;
}

DTSDF_HD uint32_t observedDirections(uint32_t sides) {
  return (sides | sides >> kBehindBit) & kAllDirections;
}

/// Those that have observed both sides of a surface; no other one speaks.
DTSDF_HD uint32_t mayBeSpeaking(uint32_t sides) {
  return sides & sides >> kBehindBit & kAllDirections;
}

/// Directions that can lead no sheet with a corner that only these have observed.
DTSDF_HD uint32_t barredLeaders(uint32_t observed) {
  constexpr uint32_t kPositive = 0x15, kNegative = 0x2A;
  const uint32_t opposite = (observed & kPositive) << 1 | (observed & kNegative) >> 1;
  const uint32_t single = (observed & (observed - 1)) == 0 ? kAllDirections : 0;
  const uint32_t none = observed == 0 ? kAllDirections : 0;
  return (opposite & single) | none;
}

/// A corner's sides, joined from its samples, with the leaders that they bar.
DTSDF_HD uint32_t sidesOfCorner(uint32_t sides_of_samples) {
  return sides_of_samples | barredLeaders(observedDirections(sides_of_samples)) << kBarredBit;
}

/// Directions that can lead a sheet of a unit, by the sides of all its corners; 0: it is empty.
DTSDF_HD uint32_t possibleLeaders(uint32_t sides_of_unit) {
  return mayBeSpeaking(sides_of_unit) & ~(sides_of_unit >> kBarredBit);
}

}  // namespace dtsdf
