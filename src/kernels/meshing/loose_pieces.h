/// Loose pieces: small ones that hang beside a larger surface, apart from it.
///
/// Where noise is wider than a voxel, a few outliers of different frames meet beside the surface
/// often enough to make a small piece of their own; so do flying pixels. Such pieces are few, but
/// lie far off. Pieces are left out that are no larger than a few units along any axis, and no
/// farther from a larger one. Small things on their own stay, however small.
///
/// A piece is what units with a surface form that share a face, or an edge that the surface
/// crosses in both. It is looked for in a window of as many units around a block: a small piece
/// that reaches into the block lies there as a whole. Of the larger one only what is in the window
/// counts, so where a piece crosses a face between blocks, one of them may keep its part.
#pragma once

#include "kernels/core/grid.h"
#include "kernels/meshing/regularisation.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// The largest pieces that may be left out, in units along an axis.
constexpr int kMostLooseUnits = 4;

/// The units of a block and of its surroundings up to there, in rows along x.
constexpr int kWindowSide = kBlockSide + 2 * kMostLooseUnits;
constexpr int kWindowRows = kWindowSide * kWindowSide;
static_assert(kWindowSide == 16, "rows fill 16 bits");

/// The row of units, given from the block's first one; and back, to the row's first unit.
DTSDF_HD int windowRow(int y, int z) {
  return y + kMostLooseUnits + kWindowSide * (z + kMostLooseUnits);
}
DTSDF_HD Vec3i firstOfRow(int row) {
  return {-kMostLooseUnits, row % kWindowSide - kMostLooseUnits,
          row / kWindowSide - kMostLooseUnits};
}

DTSDF_HD bool isInWindow(const Vec3i& unit) {
  const auto inside = [](int at) {
    return at >= -kMostLooseUnits && at < kBlockSide + kMostLooseUnits;
  };
  return inside(unit.x) && inside(unit.y) && inside(unit.z);
}

/// Whether a unit holds a surface before regularisation. (A sheet without one is never kept beside
/// another.)
DTSDF_HD bool holdsSurface(const UnitLabels& labels) {
  return labels.behind_first != 0 && labels.behind_first != 255;
}

/// Which of four units hold a surface, as bits. Their labels follow each other in the word, the
/// first one lowest.
DTSDF_HD uint32_t surfaceBits(uint64_t labels) {
  constexpr uint64_t kFirsts = 0x00ff00ff00ff00ffu, kOnes = 0x0001000100010001u;
  // 255 and 0 become 0 and 1: all that is less than 2 does not carry.
  const uint64_t next = ((labels & kFirsts) + kOnes) & kFirsts;
  const uint64_t carried = (next + 254 * kOnes) >> 8 & kOnes;
  constexpr uint64_t kToTop = uint64_t{1} << 48 | uint64_t{1} << 33 | uint64_t{1} << 18 | 1u << 3;
  return static_cast<uint32_t>(carried * kToTop >> 48 & 15u);
}

/// An edge of a unit has a number: four times its axis, and bits that say whether it is at the
/// lower (0) or upper (1) end of the two others. That of the opposite one has other bits.
constexpr int kUnitEdges = 12;
DTSDF_HD int opposite(int edge) { return edge ^ 3; }

/// The step to the unit that only shares that edge, of which it is the opposite one.
DTSDF_HD Vec3i stepOver(int edge) {
  return gridStep(edge / 4 == 0 ? 1 : 0, 2 * (edge & 1) - 1) +
         gridStep(edge / 4 == 2 ? 1 : 2, 2 * (edge >> 1 & 1) - 1);
}

/// Whether a sheet of the unit crosses the edge.
DTSDF_HD bool crosses(const UnitLabels& labels, int edge) {
  const int axis = edge / 4;
  const int lower = (edge & 1) << (axis == 0 ? 1 : 0) | (edge >> 1 & 1) << (axis == 2 ? 1 : 2);
  const int upper = lower | 1 << axis;
  const UnitIndices indices = indicesOf(labels);
  const auto differ = [&](unsigned index) { return (index >> lower ^ index >> upper) & 1u; };
  return (differ(indices.sheet[0]) | differ(indices.sheet[1])) != 0;
}

/// Labels of the units in a block and in those around it, by aroundOffset(); null where there is no
/// block, or none of its units says anything.
using LabelNeighbourhood = const UnitLabels* [kBlocksAround];

/// Visits the units of the window that a unit is joined to over an edge, but for those that it is
/// joined to over two faces.
template <class Visit>
DTSDF_HD void visitOverEdges(const LabelNeighbourhood& around, const Vec3i& unit,
                             const Visit& visit) {
  const auto at = [&](const Vec3i& of) {
    const CornerSource source = unitSource(of);
    const UnitLabels* labels = around[source.block];
    return labels == nullptr ? UnitLabels{0, 0} : labels[source.voxel];
  };
  const UnitLabels own = at(unit);
  for (int edge = 0; edge < kUnitEdges; ++edge) {
    const Vec3i step = stepOver(edge), other = unit + step;
    if (!isInWindow(other) || !crosses(own, edge)) continue;
    const UnitLabels labels = at(other);
    if (!holdsSurface(labels) || !crosses(labels, opposite(edge))) continue;
    const Vec3i first = edge / 4 == 0 ? Vec3i{0, step.y, 0} : Vec3i{step.x, 0, 0};
    if (!holdsSurface(at(unit + first)) && !holdsSurface(at(other - first))) visit(other);
  }
}

/// The places along an axis of the window where a piece has units, a bit each, folded to fewer.
constexpr int kFoldedPlaces = 8;
static_assert(kFoldedPlaces > kMostLooseUnits && kWindowSide == 2 * kFoldedPlaces, "folded once");
DTSDF_HD uint32_t folded(uint32_t bits) {
  return (bits | bits >> kFoldedPlaces) & ((1u << kFoldedPlaces) - 1u);
}

/// Whether a piece spans more than `most` places along an axis, given as bits. It has no gaps
/// there, as its units share faces or edges: so it has as many places as it spans, and still has
/// more than kMostLooseUnits once they are folded.
DTSDF_HD bool spansMore(uint32_t bits, int most) {
  for (; most > 0; --most) bits &= bits - 1u;
  return bits != 0;
}

/// By its places along each axis, which may be folded.
DTSDF_HD bool isSmall(uint32_t along_x, uint32_t along_y, uint32_t along_z, int most_units) {
  return !(spansMore(along_x, most_units) || spansMore(along_y, most_units) ||
           spansMore(along_z, most_units));
}

}  // namespace dtsdf
