/// Loose pieces: small ones that hang beside a larger surface, apart from it.
///
/// Where noise is wider than a voxel, a few outliers of different frames meet beside the surface
/// often enough to make a small piece of their own; so do flying pixels. Such pieces are few, but
/// lie far off. Pieces are left out that are no larger than a few units along any axis, and no
/// farther from a larger one. Small things on their own stay, however small.
///
/// A piece is what units with a surface form that share a face, or, if it is small by that, an edge
/// that the surface crosses in both. It is looked for in a window of as many units around a block:
/// a small piece that reaches into the block lies there as a whole. Of the larger one only what is
/// in the window counts, so where a piece crosses a face between blocks, one of them may keep its
/// part.
#pragma once

#include "kernels/core/grid.h"
#include "kernels/meshing/regularisation.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// The largest pieces that may be left out, in units along an axis.
constexpr int kMostLooseUnits = 4;

/// The units of a block and of its surroundings up to there.
constexpr int kWindowSide = kBlockSide + 2 * kMostLooseUnits;
static_assert(kWindowSide == 16, "rows fill 16 bits");

/// Rows of the window along x, of which each bit is a unit, with empty ones on each side; a power
/// of two in a layer.
constexpr int kRowStride = 2 * kWindowSide, kWindowRows = kRowStride * (kWindowSide + 2);
using WindowUnits = uint16_t[kWindowRows];
constexpr uint32_t kOwnUnits = 0xffu << kMostLooseUnits;  ///< Those of the block.

/// The row of units, given from the block's first one.
DTSDF_HD int windowRow(int y, int z) {
  return y + kMostLooseUnits + 1 + kRowStride * (z + kMostLooseUnits + 1);
}
/// The first unit of a row: the inverse of windowRow().
DTSDF_HD Vec3i firstOfRow(int row) {
  return {-kMostLooseUnits, row % kRowStride - kMostLooseUnits - 1,
          row / kRowStride - kMostLooseUnits - 1};
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

/// Whether bits span more than so many places. They have no gaps.
DTSDF_HD bool spansMore(uint32_t bits, int most) {
  for (; most > 0; --most) bits &= bits - 1u;
  return bits != 0;
}

/// Units of a window, the one row beside the other.
struct LooseWindow {
  WindowUnits surface, small, left, piece, near;
};

/// Finds the loose pieces in the window of a block. `Team` works on its rows: each(f) calls f(row)
/// for each of them, and firstOf(f) is the first one for which it has bits, or -1. begin(row, f)
/// calls it for the row that a piece begins with. For the rows that this may have by now
/// eachOfPiece(f) calls it, any(f) says whether one is true, and allOf(f) joins their bits; add()
/// is for rows of others. What was written before is seen. With kAtOnce it has a thread for each
/// row; without, `left` holds at first those units of the block that pieces are begun with, at
/// least one of each that may be loose, and all but it and `surface` is 0.
template <class Team>
class LoosePieces {
 public:
  DTSDF_HD LoosePieces(const Team& team, const LabelNeighbourhood& labels, int most_units,
                       LooseWindow& window)
      : team_(team), labels_(labels), most_units_(most_units), window_(window) {}

  /// Leaves those that reach into the block in `small`.
  DTSDF_HD void find() const {
    if (!findSmall()) return;
    findNear();
    team_.each([&](int row) {
      window_.left[row] = window_.small[row];
      window_.small[row] = window_.piece[row] = 0;
    });
    const auto isLoose = [&] {
      return isSmall() &&
             team_.any([&](int row) { return (window_.piece[row] & window_.near[row]) != 0; });
    };
    while (takePiece(true, true, isLoose)) continue;
  }

  /// Leaves in `small` the units of small pieces, joined over faces alone. @return whether some are
  /// in the block; without, others may be left out. Where rows are worked on in turn, a piece of
  /// the block counts only if it stays small when it is joined over edges, too, as few do.
  DTSDF_HD bool findSmall() const {
    if (Team::kAtOnce) takeLongRows();
    bool any = false;
    const auto isOneMore = [&] {
      const bool is_small = isSmall();
      any = any || is_small;
      return is_small;
    };
    while (takePiece(true, !Team::kAtOnce, isOneMore)) continue;
    if (!any) return false;
    if (!Team::kAtOnce) {
      team_.each([&](int row) { window_.left[row] = window_.surface[row] & ~window_.small[row]; });
    }
    while (takePiece(false, false, isOneMore)) continue;
    return true;
  }

 private:
  /// Leaves out all that hangs together with more units in a row than a small piece has, which is
  /// most of the surface: where all rows are worked on at once, that is sooner done than the same
  /// piece by piece.
  DTSDF_HD void takeLongRows() const {
    team_.each([&](int row) {
      window_.small[row] = 0;
      window_.piece[row] = 0;
      uint32_t longer = window_.surface[row];
      for (int i = 0; i < most_units_; ++i) longer &= longer >> 1;
      for (int i = 0; i < most_units_; ++i) longer |= longer << 1;
      window_.near[row] = static_cast<uint16_t>(longer);
    });
    addRows(1);
    addRows(kRowStride);
    team_.each([&](int row) { window_.piece[row] = window_.near[row]; });
    while (growsOverFaces()) continue;
    team_.each([&](int row) {
      window_.left[row] = window_.surface[row] & ~window_.piece[row];
      window_.piece[row] = 0;
    });
  }

  /// Adds those along another axis to `near`.
  DTSDF_HD void addRows(int stride) const {
    team_.each([&](int row) {
      const int at = stride == 1 ? lineOf(row) : layerOf(row);
      uint32_t longer = at + most_units_ < kWindowSide ? window_.surface[row] : 0u;
      for (int i = 1; i <= most_units_ && longer != 0; ++i) {
        longer &= window_.surface[row + i * stride];
      }
      window_.left[row] = static_cast<uint16_t>(longer);
    });
    team_.each([&](int row) {
      const int at = stride == 1 ? lineOf(row) : layerOf(row);
      uint32_t longer = window_.near[row];
      for (int i = 0; i <= most_units_ && i <= at; ++i) longer |= window_.left[row - i * stride];
      window_.near[row] = static_cast<uint16_t>(longer);
    });
  }

  /// The places that are no farther along any axis from a larger piece.
  DTSDF_HD void findNear() const {
    team_.each([&](int row) {
      uint32_t larger = window_.surface[row] & ~window_.small[row];
      for (int i = 0; i < most_units_; ++i) larger |= larger << 1 | larger >> 1;
      window_.near[row] = static_cast<uint16_t>(larger);
    });
    widen(window_.near, window_.piece, 1);
    widen(window_.piece, window_.near, kRowStride);
  }

  /// All that are so many rows apart, at most.
  DTSDF_HD void widen(const WindowUnits& from, WindowUnits& to, int stride) const {
    team_.each([&](int row) {
      const int at = stride == 1 ? lineOf(row) : layerOf(row);
      uint32_t places = from[row];
      for (int i = 1; i <= most_units_; ++i) {
        if (at >= i) places |= from[row - i * stride];
        if (at + i < kWindowSide) places |= from[row + i * stride];
      }
      to[row] = static_cast<uint16_t>(places);
    });
  }

  /// Takes the first piece that is left, or the first that reaches into the block, away, and adds
  /// it to `small` if it `isOne()`. @return whether there was one. Over edges, of one that turns
  /// out not to be small only a part. @pre No row has a piece; so it is after it.
  template <class IsOne>
  DTSDF_HD bool takePiece(bool in_block, bool over_edges, const IsOne& isOne) const {
    const auto unitsOf = [&](int row) {
      if (!in_block) return uint32_t{window_.left[row]};
      return isOwn(lineOf(row)) && isOwn(layerOf(row)) ? window_.left[row] & kOwnUnits : 0u;
    };
    const int first = team_.firstOf(unitsOf);
    if (first < 0) return false;
    team_.begin(first, [&](int row) {
      const uint32_t units = unitsOf(row);
      window_.piece[row] = static_cast<uint16_t>(units & (0u - units));
    });
    do {
      while (growsOverFaces() && (!over_edges || isSmall())) continue;
    } while (over_edges && isSmall() && growsOverEdges());
    const bool is_one = isOne();
    team_.eachOfPiece([&](int row) {
      const uint16_t piece = window_.piece[row];
      if (piece == 0) return;
      if (is_one) window_.small[row] |= piece;
      window_.left[row] &= static_cast<uint16_t>(~piece);
      window_.piece[row] = 0;
    });
    return true;
  }

  /// Rows that are worked on at once may see others before or after they grow: volatile, as both
  /// lead to the same piece once no row grows any more.
  DTSDF_HD bool growsOverFaces() const {
    return team_.any([&](int row) {
      const volatile uint16_t* const piece = window_.piece;
      const uint32_t before = piece[row], surface = window_.surface[row];
      if (before == surface) return false;
      uint32_t now = (before | piece[row + 1] | piece[row - 1] | piece[row + kRowStride] |
                      piece[row - kRowStride]) &
                     surface;
      for (uint32_t last = 0; last != now;) {
        last = now;
        now |= (now << 1 | now >> 1) & surface;
      }
      window_.piece[row] = static_cast<uint16_t>(now);
      return now != before;
    });
  }

  DTSDF_HD bool growsOverEdges() const {
    return team_.any([&](int row) {
      bool grows = false;
      const uint32_t units = window_.piece[row];
      for (int x = 0; units >> x != 0; ++x) {
        if ((units >> x & 1u) == 0) continue;
        visitOverEdges(labels_, firstOfRow(row) + gridStep(0, x), [&](const Vec3i& other) {
          const uint32_t bit = 1u << (other.x + kMostLooseUnits);
          grows |= team_.add(bit, window_.piece[windowRow(other.y, other.z)]);
        });
      }
      return grows;
    });
  }

  DTSDF_HD bool isSmall() const {
    const uint64_t places = team_.allOf([&](int row) {
      const uint64_t units = window_.piece[row];
      const uint64_t across = 1u << layerOf(row) | 1u << (16 + lineOf(row));
      return units == 0 ? uint64_t{0} : units << 32 | across;
    });
    const auto spans = [&](uint64_t from) {
      return spansMore(static_cast<uint32_t>(places >> from) & 0xffffu, most_units_);
    };
    return !(spans(0) || spans(16) || spans(32));
  }

  static DTSDF_HD int lineOf(int row) { return row % kRowStride - 1; }
  static DTSDF_HD int layerOf(int row) { return row / kRowStride - 1; }
  static DTSDF_HD bool isOwn(int at) {
    return at >= kMostLooseUnits && at < kMostLooseUnits + kBlockSide;
  }

  const Team& team_;
  const LabelNeighbourhood& labels_;
  const int most_units_;
  LooseWindow& window_;
};

}  // namespace dtsdf
