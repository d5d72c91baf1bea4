/// Loose pieces: small pieces of surface that float near a larger one.
///
/// Outliers of a few frames, and flying pixels, may coincide and form such pieces. A piece is left
/// out if it is at most a few units long along each axis and no farther than that from a larger
/// one. Small things on their own stay.
///
/// A piece consists of units with a surface that are connected through faces. If such a piece is
/// small, it is extended through edges that the surface crosses in both units. Pieces are searched
/// for in a window that extends kMaxLooseUnits around a block, so a small piece that reaches into
/// the block lies wholly in the window. Only the part of a larger piece in the window counts, so
/// where a loose piece crosses a face between blocks, one of them may keep its part.
#pragma once

#include "kernels/core/grid.h"
#include "kernels/meshing/regularisation.h"
#include "kernels/meshing/unit_samples.h"

namespace dtsdf {

/// Largest length of a loose piece along an axis, in units.
constexpr int kMaxLooseUnits = 4;

/// Side of the window: a block and its surroundings, in units.
constexpr int kWindowSide = kBlockSide + 2 * kMaxLooseUnits;
static_assert(kWindowSide == 16, "a row must fill 16 bits");

/// The window is stored as rows along x, one bit per unit, with empty rows on each side; the stride
/// of layers is a power of two.
constexpr int kRowStride = 2 * kWindowSide, kWindowRows = kRowStride * (kWindowSide + 2);
using WindowUnits = uint16_t[kWindowRows];
/// Bits of the block's own units in a row.
constexpr uint32_t kOwnUnits = 0xffu << kMaxLooseUnits;

/// The row of units at (y, z), relative to the block's first unit.
DTSDF_HD int windowRow(int y, int z) {
  return y + kMaxLooseUnits + 1 + kRowStride * (z + kMaxLooseUnits + 1);
}
/// The first unit of a row; the inverse of windowRow().
DTSDF_HD Vec3i firstOfRow(int row) {
  return {-kMaxLooseUnits, row % kRowStride - kMaxLooseUnits - 1,
          row / kRowStride - kMaxLooseUnits - 1};
}

DTSDF_HD bool isInWindow(const Vec3i& unit) {
  const auto inside = [](int at) {
    return at >= -kMaxLooseUnits && at < kBlockSide + kMaxLooseUnits;
  };
  return inside(unit.x) && inside(unit.y) && inside(unit.z);
}

/// Whether a unit holds a surface before regularisation. (A sheet without a surface is never stored
/// together with another.)
DTSDF_HD bool holdsSurface(const UnitLabels& labels) {
  return labels.behind_first != 0 && labels.behind_first != 255;
}

/// Which of four units in a row hold a surface, a bit each. `labels` holds their labels in order,
/// the first unit's in the lowest bits.
DTSDF_HD uint32_t surfaceBits(uint64_t labels) {
  constexpr uint64_t kFirsts = 0x00ff00ff00ff00ffu, kOnes = 0x0001000100010001u;
  // 255 becomes 0 and 0 becomes 1; values below 2 do not carry.
  const uint64_t next = ((labels & kFirsts) + kOnes) & kFirsts;
  const uint64_t carried = (next + 254 * kOnes) >> 8 & kOnes;
  constexpr uint64_t kToTop = uint64_t{1} << 48 | uint64_t{1} << 33 | uint64_t{1} << 18 | 1u << 3;
  return static_cast<uint32_t>(carried * kToTop >> 48 & 15u);
}

/// Number of an edge of a unit: four times the axis, plus two bits for whether the edge is at the
/// lower (0) or upper (1) end of the other two axes. The opposite edge has both bits flipped.
constexpr int kUnitEdges = 12;
DTSDF_HD int opposite(int edge) { return edge ^ 3; }

/// Step to the unit that shares only this edge; there, it is the opposite edge.
DTSDF_HD Vec3i stepOver(int edge) {
  return gridStep(edge / 4 == 0 ? 1 : 0, 2 * (edge & 1) - 1) +
         gridStep(edge / 4 == 2 ? 1 : 2, 2 * (edge >> 1 & 1) - 1);
}

/// Whether a sheet of the unit crosses an edge.
DTSDF_HD bool crosses(const UnitLabels& labels, int edge) {
  const int axis = edge / 4;
  const int lower = (edge & 1) << (axis == 0 ? 1 : 0) | (edge >> 1 & 1) << (axis == 2 ? 1 : 2);
  const int upper = lower | 1 << axis;
  const UnitIndices indices = indicesOf(labels);
  const auto differ = [&](unsigned index) { return (index >> lower ^ index >> upper) & 1u; };
  return (differ(indices.sheet[0]) | differ(indices.sheet[1])) != 0;
}

/// Labels of the units in a block and in the blocks around it, in the order of aroundOffset(); null
/// for a missing block, or one whose units are all empty.
using LabelNeighbourhood = const UnitLabels* [kBlocksAround];

/// Calls visit(other) for the units of the window that are connected to a unit through an edge, but
/// not also through the faces of a unit beside both.
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

/// Whether more than `most` bits are set.
DTSDF_HD bool spansMore(uint32_t bits, int most) {
  for (; most > 0; --most) bits &= bits - 1u;
  return bits != 0;
}

/// Sets of units in the window.
struct LooseWindow {
  WindowUnits surface, small, left, piece, near;
};

/// Finds the loose pieces in a block's window. `Team` runs functions of a row:
/// - each(f) calls f(row) for all rows; begin(row, f) only for a new piece's first row.
/// - firstOf(f) returns the first row for which f(row) is not 0, or -1.
/// - eachOfPiece(f) calls f(row) for all rows that the piece may have reached; any(f) returns
///   whether f is true for one of them, allOf(f) the union of its bits.
/// - add(bit, units) adds a bit to any row, and returns whether it is new.
///
/// Each call sees what earlier ones wrote. A team with kAtOnce has a thread for each row. At first,
/// `surface` holds the units with a surface. Without kAtOnce, `left` must hold the block's units
/// from which pieces are grown, at least one of each piece that may be loose, and the other sets
/// must be empty.
template <class Team>
class LoosePieces {
 public:
  DTSDF_HD LoosePieces(const Team& team, const LabelNeighbourhood& labels, int max_units,
                       LooseWindow& window)
      : team_(team), labels_(labels), max_units_(max_units), window_(window) {}

  /// Stores the loose pieces that reach into the block in `small`.
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
    while (removePiece(true, true, isLoose)) continue;
  }

  /// Stores the units of small pieces, connected through faces alone, in `small`. @return whether
  /// any is in the block; if not, `small` may be incomplete. Without kAtOnce, pieces in the block
  /// are stored only if they are still small when connected through edges as well.
  DTSDF_HD bool findSmall() const {
    if (Team::kAtOnce) removeLongRows();
    bool any = false;
    const auto countSmall = [&] {
      const bool is_small = isSmall();
      any = any || is_small;
      return is_small;
    };
    while (removePiece(true, !Team::kAtOnce, countSmall)) continue;
    if (!any) return false;
    if (!Team::kAtOnce) {
      team_.each([&](int row) { window_.left[row] = window_.surface[row] & ~window_.small[row]; });
    }
    while (removePiece(false, false, countSmall)) continue;
    return true;
  }

 private:
  /// Stores in `left` the surface without pieces that have a line of more than max_units_ units;
  /// such pieces make up most of it. With a thread per row, this is faster than growing them one by
  /// one.
  DTSDF_HD void removeLongRows() const {
    team_.each([&](int row) {
      window_.small[row] = 0;
      window_.piece[row] = 0;
      uint32_t longer = window_.surface[row];
      for (int i = 0; i < max_units_; ++i) longer &= longer >> 1;
      for (int i = 0; i < max_units_; ++i) longer |= longer << 1;
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

  /// Adds to `near` the units of such lines along another axis.
  DTSDF_HD void addRows(int stride) const {
    team_.each([&](int row) {
      const int at = stride == 1 ? lineOf(row) : layerOf(row);
      uint32_t longer = at + max_units_ < kWindowSide ? window_.surface[row] : 0u;
      for (int i = 1; i <= max_units_ && longer != 0; ++i) {
        longer &= window_.surface[row + i * stride];
      }
      window_.left[row] = static_cast<uint16_t>(longer);
    });
    team_.each([&](int row) {
      const int at = stride == 1 ? lineOf(row) : layerOf(row);
      uint32_t longer = window_.near[row];
      for (int i = 0; i <= max_units_ && i <= at; ++i) longer |= window_.left[row - i * stride];
      window_.near[row] = static_cast<uint16_t>(longer);
    });
  }

  /// Stores in `near` the places at most max_units_ away from a larger piece along each axis.
  DTSDF_HD void findNear() const {
    team_.each([&](int row) {
      uint32_t larger = window_.surface[row] & ~window_.small[row];
      for (int i = 0; i < max_units_; ++i) larger |= larger << 1 | larger >> 1;
      window_.near[row] = static_cast<uint16_t>(larger);
    });
    widen(window_.near, window_.piece, 1);
    widen(window_.piece, window_.near, kRowStride);
  }

  /// Widens a set by max_units_ rows to each side.
  DTSDF_HD void widen(const WindowUnits& from, WindowUnits& to, int stride) const {
    team_.each([&](int row) {
      const int at = stride == 1 ? lineOf(row) : layerOf(row);
      uint32_t places = from[row];
      for (int i = 1; i <= max_units_; ++i) {
        if (at >= i) places |= from[row - i * stride];
        if (at + i < kWindowSide) places |= from[row + i * stride];
      }
      to[row] = static_cast<uint16_t>(places);
    });
  }

  /// Grows a piece from the first unit in `left` (with in_block, the first in the block) and
  /// removes it from `left`; adds it to `small` if isOne(). With over_edges, it also grows through
  /// edges while it is small; of a larger piece, only a part is removed. @return false if there was
  /// no unit. `piece` must be empty, and is empty afterwards.
  template <class IsOne>
  DTSDF_HD bool removePiece(bool in_block, bool over_edges, const IsOne& isOne) const {
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

  /// Rows that grow at the same time may or may not see each other's new units, hence volatile; the
  /// piece is the same in the end, when no row grows any more.
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
          const uint32_t bit = 1u << (other.x + kMaxLooseUnits);
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
      return spansMore(static_cast<uint32_t>(places >> from) & 0xffffu, max_units_);
    };
    return !(spans(0) || spans(16) || spans(32));
  }

  static DTSDF_HD int lineOf(int row) { return row % kRowStride - 1; }
  static DTSDF_HD int layerOf(int row) { return row / kRowStride - 1; }
  static DTSDF_HD bool isOwn(int at) {
    return at >= kMaxLooseUnits && at < kMaxLooseUnits + kBlockSide;
  }

  const Team& team_;
  const LabelNeighbourhood& labels_;
  const int max_units_;
  LooseWindow& window_;
};

}  // namespace dtsdf
