/// Regularisation, the first step of the make stage: corners that the units around them disagree
/// about.
#pragma once

#include "kernels/core/grid.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// The unit across face 0 to 5: -x, +x, -y, +y, -z, +z.
DTSDF_HD Vec3i faceOffset(int face) {
  const int32_t step = (face & 1) ? 1 : -1;
  return {face >> 1 == 0 ? step : 0, face >> 1 == 1 ? step : 0, face >> 1 == 2 ? step : 0};
}

/// Labels of the four corners on a face of a unit, as seen from the unit across it: the neighbour's
/// corner c with the axis bit flipped is the own corner on that face.
DTSDF_HD uint8_t mirrorFace(uint8_t index, int axis) {
  const unsigned lower_corners = axis == 0 ? 0x55u : (axis == 1 ? 0x33u : 0x0Fu);
  const int shift = 1 << axis;
  return static_cast<uint8_t>(((index & lower_corners) << shift) |
                              ((index >> shift) & lower_corners));
}

DTSDF_HD unsigned faceCorners(int face) {
  const int axis = face >> 1;
  const unsigned lower_corners = axis == 0 ? 0x55u : (axis == 1 ? 0x33u : 0x0Fu);
  return (face & 1) ? lower_corners << (1 << axis) : lower_corners;
}

/// Whether two labellings of a face are traces of one surface: some edge of the face is crossed by
/// both in the same way, and none in opposite ways.
DTSDF_HD bool continueAcross(uint8_t a, uint8_t b, int face) {
  const unsigned shared = faceCorners(face);
  unsigned same = 0, opposite = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == face >> 1) continue;
    const ParallelCrossings in_a = parallelCrossings(a, axis), in_b = parallelCrossings(b, axis);
    same |= (in_a.rising & in_b.rising) | (in_a.falling & in_b.falling);
    opposite |= (in_a.rising & in_b.falling) | (in_a.falling & in_b.rising);
  }
  return (same & shared) != 0 && (opposite & shared) == 0;
}

/// The labels that a neighbour gives the corners on a face, from whichever of its sheets continues
/// the surface of `index`; -1 if none does.
DTSDF_HD int labelsAcross(uint8_t index, const UnitIndices& neighbour, int face) {
  for (int s = 0; s < kMaxSheets; ++s) {
    const uint8_t labels = mirrorFace(neighbour.sheet[s], face >> 1);
    if (neighbour.sheet[s] != 0 && continueAcross(index, labels, face)) return labels;
  }
  return -1;
}

/// Whether a neighbour can disagree with `index` about a corner of the face between them.
DTSDF_HD bool mayDisagree(uint8_t index, const UnitIndices& neighbour, int face) {
  const unsigned shared = faceCorners(face);
  bool differs = false;
  for (int s = 0; s < kMaxSheets; ++s) {
    const uint8_t labels = mirrorFace(neighbour.sheet[s], face >> 1);
    differs = differs || (neighbour.sheet[s] != 0 && ((labels ^ index) & shared) != 0);
  }
  return differs;
}

/// Regularisation (paper, Sec. V-F): a corner takes the side that most of the units around it give
/// it, among the face neighbours whose surface continues this one. Reads the indices as they were
/// before regularisation, so the result does not depend on any order.
///
/// Of the unit and up to three neighbours, most are against the unit only if two disagree with it
/// and none agrees.
DTSDF_HD uint8_t regulariseSheet(uint8_t index, const UnitIndices (&neighbours)[6]) {
  int faces = 0;
  for (int face = 0; face < 6; ++face) faces += mayDisagree(index, neighbours[face], face) ? 1 : 0;
  if (faces < 2) return index;
  unsigned agreed = 0, disagreed = 0, disagreed_twice = 0;  // bits of corners
  for (int face = 0; face < 6; ++face) {
    const int labels = labelsAcross(index, neighbours[face], face);
    if (labels < 0) continue;
    const unsigned shared = faceCorners(face), differing = (labels ^ index) & shared;
    agreed |= shared & ~differing;
    disagreed_twice |= disagreed & differing;
    disagreed |= differing;
  }
  const uint8_t regular = static_cast<uint8_t>(index ^ (disagreed_twice & ~agreed));
  return regular == 255 ? 0 : regular;
}

/// Both sheets of a unit, each against both of each neighbour.
DTSDF_HD UnitIndices regulariseSheets(const UnitIndices& own, const UnitIndices (&neighbours)[6]) {
  UnitIndices result = own;
  for (uint8_t& index : result.sheet) {
    if (index != 0) index = regulariseSheet(index, neighbours);
  }
  return result;
}

/// A block and its face neighbours: the blocks whose units are regularised against a block's.
constexpr int kRegularisationReach = 7;
DTSDF_HD Vec3i regularisationOffset(int n) {
  return n == 0 ? Vec3i{0, 0, 0} : faceOffset(n - 1);
}

/// Where the indices of a unit lie that is in a block or across one of its faces: n as in
/// regularisationOffset(n), and the unit's number in that block.
struct UnitSource {
  int block, unit;
};

DTSDF_HD UnitSource unitSource(const Vec3i& unit) {
  constexpr int kMask = kBlockSide - 1;
  int block = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int32_t x = component(unit, axis);
    if (x < 0) block = 1 + 2 * axis;
    if (x >= kBlockSide) block = 2 + 2 * axis;
  }
  return {block, voxelIndex(unit.x & kMask, unit.y & kMask, unit.z & kMask)};
}

/// A unit's indices after regularisation. `at(unit)` gives the indices before it, in the block and
/// across its faces.
template <class At>
DTSDF_HD UnitIndices regulariseUnit(const At& at, const Vec3i& unit) {
  const UnitIndices own = at(unit);
  if (own.sheet[0] == 0) return own;
  UnitIndices neighbours[6];
  for (int face = 0; face < 6; ++face) neighbours[face] = at(unit + faceOffset(face));
  return regulariseSheets(own, neighbours);
}

}  // namespace dtsdf
