/// Finds which directions can lead a sheet (findLeaders()) in a unit, from the sides of its corners
/// alone, so that the index stage can skip units without a surface.
///
/// No direction is rejected that the other stages would accept, regardless of the MeshRules. The
/// leader of a sheet meets two conditions:
/// - It is active, so it has observed corners on both sides of a surface (directionConfidence()).
/// - At each corner, some direction other than the leader's opposite votes; the opposite has no
///   vote (voteOnCorners()). So each corner was observed by a direction other than the opposite.
///
/// A unit in which no direction meets both conditions has no surface. In an undirected map, the
/// only direction must have observed all corners, and both sides of a surface.
#pragma once

#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// Sides of a corner. Direction d sets bit d if the corner is in front of its surface, bit 8 + d if
/// behind it, bit 16 + d if it cannot lead any sheet around the corner, and bit 24 + d if it has a
/// negative distance there. The sides of a unit are the bitwise OR of its corners' sides.
constexpr int kBehindBit = 8, kExcludedBit = 16, kNegativeBit = 24;

/// The sides according to one direction's sample; both if the surface touches the corner.
DTSDF_HD uint32_t sidesOfSample(int direction, float sdf, float weight) {
  const uint32_t in_front = sdf >= -kTouching ? 1u << direction : 0u;
  const uint32_t behind = sdf < kTouching ? 1u << (kBehindBit + direction) : 0u;
  const uint32_t negative = sdf < 0.0f ? 1u << (kNegativeBit + direction) : 0u;
  return weight > 0.0f ? in_front | behind | negative : 0u;
}

DTSDF_HD uint32_t observedDirections(uint32_t sides) {
  return (sides | sides >> kBehindBit) & kAllDirections;
}

/// Directions that have observed both sides of a surface; only these can be active.
DTSDF_HD uint32_t possiblyActive(uint32_t sides) {
  return sides & sides >> kBehindBit & kAllDirections;
}

/// Directions that cannot lead any sheet around a corner, given the directions that have observed
/// it.
DTSDF_HD uint32_t excludedLeaders(uint32_t observed) {
  constexpr uint32_t kPositive = 0x15, kNegative = 0x2A;
  const uint32_t opposite = (observed & kPositive) << 1 | (observed & kNegative) >> 1;
  const uint32_t single = (observed & (observed - 1)) == 0 ? kAllDirections : 0;
  const uint32_t none = observed == 0 ? kAllDirections : 0;
  return (opposite & single) | none;
}

/// A corner's sides, including the leaders that its samples exclude.
/// @param sides_of_samples Bitwise OR of the samples' sides.
DTSDF_HD uint32_t sidesOfCorner(uint32_t sides_of_samples) {
  return sides_of_samples | excludedLeaders(observedDirections(sides_of_samples)) << kExcludedBit;
}

/// Directions that can lead a sheet of a unit, from the unit's sides; 0 if the unit is empty.
DTSDF_HD uint32_t possibleLeaders(uint32_t sides_of_unit) {
  return possiblyActive(sides_of_unit) & ~(sides_of_unit >> kExcludedBit);
}

}  // namespace dtsdf
