#include "cpu/loose_units.h"

#include <algorithm>
#include <cstring>

namespace dtsdf {
namespace {

/// Units of a window (loose_pieces.h): its rows, a bit for each unit.
using WindowRows = std::array<uint16_t, kWindowRows>;

constexpr uint32_t kOwnUnits = 0xffu << kMostLooseUnits;  ///< Those of a row that are the block's.

/// Calls visit(row of the window, y, z) for the rows of the block.
template <class Visit>
void visitOwnRows(const Visit& visit) {
  for (int z = 0; z < kBlockSide; ++z) {
    for (int y = 0; y < kBlockSide; ++y) visit(windowRow(y, z), y, z);
  }
}

/// Units that hang together, and where along each axis they are, a bit for each place.
struct Piece {
  WindowRows rows = {};
  uint32_t along_x = 0, along_y = 0, along_z = 0;

  bool isSmall(int most_units) const {
    return dtsdf::isSmall(along_x, along_y, along_z, most_units);
  }
};

/// Moves all that hangs together over faces with some units of a row from a surface to a piece.
void movePiece(WindowRows& surface, int row, uint32_t units, Piece& piece) {
  units &= surface[row];
  if (units == 0) return;
  for (uint32_t before = 0; before != units;) {
    before = units;
    units |= (units << 1 | units >> 1) & surface[row];
  }
  const int y = row % kWindowSide, z = row / kWindowSide;
  surface[row] = static_cast<uint16_t>(surface[row] & ~units);
  piece.rows[row] = static_cast<uint16_t>(piece.rows[row] | units);
  piece.along_x |= units;
  piece.along_y |= 1u << y;
  piece.along_z |= 1u << z;
  if (y > 0) movePiece(surface, row - 1, units, piece);
  if (y + 1 < kWindowSide) movePiece(surface, row + 1, units, piece);
  if (z > 0) movePiece(surface, row - kWindowSide, units, piece);
  if (z + 1 < kWindowSide) movePiece(surface, row + kWindowSide, units, piece);
}

uint32_t firstUnit(uint32_t units) { return units & (0u - units); }

/// The units of those pieces that are small, joined over faces alone.
WindowRows smallPieces(WindowRows surface, int most_units) {
  WindowRows small = {};
  for (int row = 0; row < kWindowRows; ++row) {
    while (surface[row] != 0) {
      Piece piece;
      movePiece(surface, row, firstUnit(surface[row]), piece);
      if (!piece.isSmall(most_units)) continue;
      for (int i = 0; i < kWindowRows; ++i) small[i] |= piece.rows[i];
    }
  }
  return small;
}

WindowRows rowsOf(const BlockBits& units) {
  WindowRows rows = {};
  visitOwnRows([&](int row, int y, int z) {
    rows[row] = static_cast<uint16_t>((units[z] >> (kBlockSide * y) & 0xffu) << kMostLooseUnits);
  });
  return rows;
}

/// The surface in the whole window.
WindowRows surfaceAround(const LabelNeighbourhood& labels) {
  WindowRows rows = {};
  for (int row = 0; row < kWindowRows; ++row) {
    for (int first = 0; first < kWindowSide; first += 4) {
      const CornerSource source = unitSource(firstOfRow(row) + gridStep(0, first));
      if (labels[source.block] == nullptr) continue;
      uint64_t four;
      std::memcpy(&four, labels[source.block] + source.voxel, sizeof(four));
      rows[row] = static_cast<uint16_t>(rows[row] | surfaceBits(four) << first);
    }
  }
  return rows;
}

/// Places that are no farther along any axis from one of the units.
WindowRows widened(const WindowRows& units, int most_units) {
  WindowRows places = {};
  for (int row = 0; row < kWindowRows; ++row) {
    uint32_t bits = units[row];
    if (bits == 0) continue;
    for (int i = 0; i < most_units; ++i) bits |= bits << 1 | bits >> 1;
    const int y = row % kWindowSide, z = row / kWindowSide, last = kWindowSide - 1;
    for (int to_z = std::max(z - most_units, 0); to_z <= std::min(z + most_units, last); ++to_z) {
      for (int to_y = std::max(y - most_units, 0); to_y <= std::min(y + most_units, last); ++to_y) {
        uint16_t& place = places[to_y + kWindowSide * to_z];
        place = static_cast<uint16_t>(place | bits);
      }
    }
  }
  return places;
}

/// The piece of a unit, joined over edges as well; once it is not small, a part of it.
Piece pieceOverEdges(WindowRows surface, const LabelNeighbourhood& labels, int row, uint32_t unit,
                     int most_units) {
  Piece piece;
  movePiece(surface, row, unit, piece);
  for (bool grows = true; grows && piece.isSmall(most_units);) {
    const WindowRows before = piece.rows;
    for (int i = 0; i < kWindowRows; ++i) {
      for (uint32_t rest = before[i]; rest != 0; rest &= rest - 1) {
        const Vec3i at = firstOfRow(i) + gridStep(0, __builtin_ctz(rest));
        visitOverEdges(labels, at, [&](const Vec3i& other) {
          movePiece(surface, windowRow(other.y, other.z), 1u << (other.x + kMostLooseUnits), piece);
        });
      }
    }
    grows = piece.rows != before;
  }
  return piece;
}

bool haveCommon(const WindowRows& a, const WindowRows& b) {
  uint32_t common = 0;
  for (int row = 0; row < kWindowRows; ++row) common |= a[row] & b[row];
  return common != 0;
}

}  // namespace

BlockBits looseUnits(const BlockBits& surface, const LabelNeighbourhood& labels, int most_units) {
  BlockBits loose = {};
  const WindowRows nothing = {};
  if (most_units == 0 || smallPieces(rowsOf(surface), most_units) == nothing) return loose;
  const WindowRows around = surfaceAround(labels);
  WindowRows small = smallPieces(around, most_units), larger = around;
  for (int row = 0; row < kWindowRows; ++row) larger[row] &= static_cast<uint16_t>(~small[row]);
  const WindowRows beside_larger = widened(larger, most_units);
  visitOwnRows([&](int row, int, int) {
    while ((small[row] & kOwnUnits) != 0) {
      const Piece piece =
          pieceOverEdges(around, labels, row, firstUnit(small[row] & kOwnUnits), most_units);
      for (int i = 0; i < kWindowRows; ++i) small[i] &= static_cast<uint16_t>(~piece.rows[i]);
      if (!piece.isSmall(most_units) || !haveCommon(piece.rows, beside_larger)) continue;
      visitOwnRows([&](int own, int y, int z) {
        const uint64_t units = piece.rows[own] >> kMostLooseUnits & 0xffu;
        loose[z] |= units << (kBlockSide * y);
      });
    }
  });
  return loose;
}

}  // namespace dtsdf
