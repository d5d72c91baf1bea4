/// Regularisation, the first step of the make stage: on which side a corner is where the units
/// around it disagree, and where a unit that knows too little is no hole.
///
/// Units disagree about a corner where their leaders differ, and where one has dropped what another
/// keeps. The side that most of them give it is a property of the corner, which they all take: so
/// units side by side cross the face between them in the same way, and leave no slit.
///
/// Whether enough is known changes from one unit to the next where images disagree. So a unit that
/// says nothing closes a hole where those around it know the surface.
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

/// Whether some unit around a corner gives it a side.
template <class At>
DTSDF_HD bool isGivenASide(const At& at, const Vec3i& corner) {
  bool is_given = false;
  for (int c = 0; c < kCubeCorners; ++c) {
    is_given = is_given || sideGiven(at(corner - cornerOffset(c)), c) != 0;
  }
  return is_given;
}

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

/// The corners of a unit as those around settle them, bit c for corner c: which are behind for most
/// of the units around them, and which get a side from any.
struct SettledCorners {
  unsigned behind, given;
};

/// The corners of a unit on its face at the lower (0) or upper (1) end of an axis.
DTSDF_HD unsigned faceCorners(int axis, int end) {
  const unsigned upper = axis == 0 ? 0xaau : (axis == 1 ? 0xccu : 0xf0u);
  return end != 0 ? upper : ~upper & 255u;
}

/// Whether the surface of an index crosses a face, given by its corners.
DTSDF_HD bool crossesFace(unsigned index, unsigned face) {
  return (index & face) != 0 && (index & face) != face;
}

/// Whether the surface of an index goes on across all faces that it crosses: the units beyond say
/// something. `at(unit)` gives what units say.
template <class At>
DTSDF_HD bool goesOnAround(const At& at, const Vec3i& unit, unsigned index) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int end = 0; end < 2; ++end) {
      if (!crossesFace(index, faceCorners(axis, end))) continue;
      if (saysNothing(at(unit + gridStep(axis, 2 * end - 1)))) return false;
    }
  }
  return true;
}

/// The corners beside some of a unit's, along its edges.
DTSDF_HD unsigned cornersBeside(unsigned corners) {
  return (corners << 1 & 0xaau) | (corners >> 1 & 0x55u) | (corners << 2 & 0xccu) |
         (corners >> 2 & 0x33u) | (corners << 4 & 0xf0u) | (corners >> 4 & 0x0fu);
}

/// The index of corners some of which get no side. No edge at one of these may be crossed: so it
/// takes the side of the corners beside it, from one that gets none to the next; no surface (0) if
/// these differ.
DTSDF_HD unsigned completedIndex(const SettledCorners& corners) {
  unsigned behind = corners.behind & corners.given, in_front = corners.given & ~corners.behind;
  for (int i = 0; i < 3; ++i) {
    behind |= cornersBeside(behind) & ~corners.given;
    in_front |= cornersBeside(in_front) & ~corners.given;
  }
  return (behind & in_front) == 0 ? behind : 0u;
}

/// The index of a unit that says nothing: by the sides that its corners get from the units around,
/// those components that close a hole. The surface goes on across all faces that they cross, so
/// their vertices are those of units that say something, and no outline grows.
template <class At>
DTSDF_HD unsigned closingIndex(const MeshTables& tables, const At& at, const Vec3i& unit,
                               const SettledCorners& corners) {
  const unsigned labels = completedIndex(corners);
  auto index = static_cast<uint8_t>(labels);
  for (int i = 0; i < tables.component_count[labels]; ++i) {
    const uint8_t component = tables.component[labels][i];
    if (!goesOnAround(at, unit, component)) index = removeComponent(index, component);
  }
  return index;
}

/// A unit's indices as the units around settle them. Not in the undirected map does one that says
/// nothing close a hole: its units say nothing where they have no surface.
template <class At>
DTSDF_HD UnitIndices settledIndices(const MeshTables& tables, const At& at, const Vec3i& unit,
                                    const SettledCorners& corners, bool directional) {
  const UnitLabels own = at(unit);
  if (!saysNothing(own)) return regularise(own, corners.behind);
  const unsigned index = directional ? closingIndex(tables, at, unit, corners) : 0u;
  return {{static_cast<uint8_t>(index), 0}};
}

/// Where the labels of a unit lie that is in a block or in one of those around it: its number among
/// them (aroundOffset), and the unit's number there.
struct UnitSource {
  int block, unit;
};

DTSDF_HD UnitSource unitSource(const Vec3i& unit) {
  constexpr int kMask = kBlockSide - 1;
  return {blockAround(unit), voxelIndex(unit.x & kMask, unit.y & kMask, unit.z & kMask)};
}

}  // namespace dtsdf
