/// Regularisation: decides on which side of the surface a corner lies if the units around it
/// disagree.
///
/// Units may disagree if different directions lead in them, or if one has dropped a component that
/// another keeps. Where a unit's sheets agree about a corner, the corner takes the side that most
/// units around it assign to it. So the surfaces of neighbouring units meet at their common face
/// and leave no slit.
#pragma once

#include "kernels/core/grid.h"
#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// The side that a unit assigns to one of its corners: 1 behind, -1 in front, 0 if the unit is
/// empty or its sheets disagree.
DTSDF_HD int sideOfCorner(const UnitLabels& labels, int c) {
  return static_cast<int>(cornersBehind(labels) >> c & 1u) -
         static_cast<int>(cornersInFront(labels) >> c & 1u);
}

/// Position of corner c of a unit, relative to the first corner.
DTSDF_HD Vec3i cornerOffset(int c) { return {c & 1, c >> 1 & 1, c >> 2 & 1}; }

/// Number of units around a corner for which it is behind the surface, minus the number for which
/// it is in front. `at(unit)` returns a unit's labels.
template <class At>
DTSDF_HD int cornerBalance(const At& at, const Vec3i& corner) {
  int balance = 0;
  for (int c = 0; c < kCubeCorners; ++c) balance += sideOfCorner(at(corner - cornerOffset(c)), c);
  return balance;
}

/// Whether the majority of units assigns a corner to the back of the surface; in a tie, it is in
/// front.
DTSDF_HD bool isMajorityBehind(int balance) { return balance > 0; }

/// A unit's marching cubes cases after regularisation (paper, Sec. V-F). A corner about which its
/// sheets agree takes the side that most units around it assign to it (`majority_behind`). Other
/// corners are not changed, since they lie between the two sides of a thin object.
DTSDF_HD UnitIndices regularise(const UnitLabels& own, unsigned majority_behind) {
  const UnitIndices indices = indicesOf(own);
  const unsigned agreed = cornersBehind(own) | cornersInFront(own);
  const auto settled = [&](uint8_t index) {
    return static_cast<uint8_t>((index & ~agreed) | (majority_behind & agreed));
  };
  return indicesOf(labelsOfSheets(settled(indices.sheet[0]),
                                  settled(static_cast<uint8_t>(~own.in_front_of_last))));
}

/// Location of a unit's labels: the index (aroundNumber()) of its block, and the unit's index in
/// the block. `unit` is relative to the central block's first unit.
DTSDF_HD CornerSource unitSource(const Vec3i& unit) {
  return {blockAround(unit), indexInBlock(unit)};
}

/// Labels of the units in a block and in the blocks around it, in the order of aroundOffset(); null
/// for a missing block, or one whose units are all empty.
using LabelNeighbourhood = const UnitLabels* [kBlocksAround];

}  // namespace dtsdf
