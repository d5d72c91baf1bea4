/// Regularisation, the first step of the make stage: on which side a corner is where the units
/// around it disagree.
///
/// They disagree where their leaders differ, and where one has dropped what another keeps. The side
/// that most of them give it is a property of the corner, which they all take: so units side by
/// side cross the face between them in the same way, and leave no slit.
#pragma once

#include "kernels/core/grid.h"
#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// The side that a unit gives one of its corners: 1 behind, -1 in front, 0 where it says nothing or
/// has sheets that disagree.
DTSDF_HD int sideGiven(const UnitLabels& labels, int c) {
  return static_cast<int>(cornersBehind(labels) >> c & 1u) -
         static_cast<int>(cornersInFront(labels) >> c & 1u);
}

/// Where corner c of a unit lies, from its first one.
DTSDF_HD Vec3i cornerOffset(int c) { return {c & 1, c >> 1 & 1, c >> 2 & 1}; }

/// Units around a corner that have it behind, less those that have it in front. `at(unit)` gives
/// what they say.
template <class At>
DTSDF_HD int cornerBalance(const At& at, const Vec3i& corner) {
  int balance = 0;
  for (int c = 0; c < kCubeCorners; ++c) balance += sideGiven(at(corner - cornerOffset(c)), c);
  return balance;
}

/// Behind, for all units around, is a corner that most of them have there; half are too few.
DTSDF_HD bool isBehindForMost(int balance) { return balance > 0; }

/// A unit's indices after regularisation (paper, Sec. V-F): of the corners that its sheets agree
/// about, those are behind that most units around have there, `behind_for_most`. Where its sheets
/// disagree, they stay as they are: these are the two sides of something thin.
DTSDF_HD UnitIndices regularise(const UnitLabels& own, unsigned behind_for_most) {
  const UnitIndices indices = indicesOf(own);
  const unsigned agreed = cornersBehind(own) | cornersInFront(own);
  const auto settled = [&](uint8_t index) {
    return static_cast<uint8_t>((index & ~agreed) | (behind_for_most & agreed));
  };
  return indicesOf(labelsOfSheets(settled(indices.sheet[0]),
                                  settled(static_cast<uint8_t>(~own.in_front_of_last))));
}

/// Where the labels of a unit lie that is in a block or in one of those around it: the number of
/// that (aroundOffset), and the unit's number there.
DTSDF_HD CornerSource unitSource(const Vec3i& unit) {
  return {blockAround(unit), indexInBlock(unit)};
}

}  // namespace dtsdf
