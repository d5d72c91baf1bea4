#include "cpu/loose_units.h"

#include <algorithm>
#include <cstring>

namespace dtsdf {
namespace {

/// A team for LoosePieces with a single thread, which processes the rows of a window in order.
class SequentialRows {
 public:
  static constexpr bool kAtOnce = false;

  template <class Visit>
  void each(const Visit& visit) const {
    for (int z = kFirst; z < kEnd; ++z) eachOfLayer(z, visit);
  }
  template <class Bits>
  int firstOf(const Bits& bits) const {
    for (int z = kFirst; z < kEnd; ++z) {
      for (int y = kFirst; y < kEnd; ++y) {
        if (bits(windowRow(y, z)) != 0) return windowRow(y, z);
      }
    }
    return -1;
  }
  template <class Visit>
  void begin(int row, const Visit& visit) const {
    low_ = high_ = firstOfRow(row).z;
    visit(row);
  }
  template <class Visit>
  void eachOfPiece(const Visit& visit) const {
    for (int z = std::max(low_ - 1, kFirst); z < std::min(high_ + 2, kEnd); ++z) {
      eachOfLayer(z, visit);
    }
  }
  /// Where holds(row) is true, the piece may have grown, possibly into adjacent layers.
  template <class Holds>
  bool any(const Holds& holds) const {
    bool any = false;
    int low = low_, high = high_;
    eachOfPiece([&](int row) {
      if (!holds(row)) return;
      any = true;
      low = std::min(low, firstOfRow(row).z - 1);
      high = std::max(high, firstOfRow(row).z + 1);
    });
    low_ = low;
    high_ = high;
    return any;
  }
  template <class Bits>
  uint64_t allOf(const Bits& bits) const {
    uint64_t all = 0;
    eachOfPiece([&](int row) { all |= bits(row); });
    return all;
  }
  bool add(uint32_t bits, uint16_t& row) const {
    const bool adds = (bits & ~uint32_t{row}) != 0;
    row = static_cast<uint16_t>(row | bits);
    return adds;
  }

 private:
  template <class Visit>
  void eachOfLayer(int z, const Visit& visit) const {
    for (int y = kFirst; y < kEnd; ++y) visit(windowRow(y, z));
  }

  /// Range of y and z, relative to the block's first unit.
  static constexpr int kFirst = -kMaxLooseUnits, kEnd = kBlockSide + kMaxLooseUnits;

  mutable int low_ = 0, high_ = 0;  ///< Layers where the piece may have units.
};

/// The units that are connected to the first one through faces.
BlockBits firstPiece(const BlockBits& units) {
  constexpr uint64_t kFirstColumn = 0x0101010101010101u, kLastColumn = kFirstColumn << 7;
  BlockBits piece = {};
  const auto layer =
      std::find_if(units.begin(), units.end(), [](uint64_t bits) { return bits != 0; });
  piece[static_cast<size_t>(layer - units.begin())] = *layer & (uint64_t{0} - *layer);
  for (bool grows = true; grows;) {
    grows = false;
    for (size_t z = 0; z < kBlockSide; ++z) {
      const uint64_t own = piece[z];
      const uint64_t below = z > 0 ? piece[z - 1] : 0,
                     above = z + 1 < kBlockSide ? piece[z + 1] : 0;
      const uint64_t beside = (own & ~kLastColumn) << 1 | (own & ~kFirstColumn) >> 1 |
                              own << kBlockSide | own >> kBlockSide;
      piece[z] |= (below | above | beside) & units[z];
      grows |= piece[z] != own;
    }
  }
  return piece;
}

bool isSmall(const BlockBits& piece, int max_units) {
  uint32_t along_x = 0, along_y = 0, along_z = 0;
  for (int z = 0; z < kBlockSide; ++z) {
    along_z |= (piece[z] != 0 ? 1u : 0u) << z;
    for (int y = 0; y < kBlockSide; ++y) {
      const auto row = static_cast<uint32_t>(piece[z] >> (kBlockSide * y) & 0xffu);
      along_x |= row;
      along_y |= (row != 0 ? 1u : 0u) << y;
    }
  }
  return !(spansMore(along_x, max_units) || spansMore(along_y, max_units) ||
           spansMore(along_z, max_units));
}

/// The units of pieces that are small within the block. Most blocks have none, and so no loose
/// pieces.
BlockBits possiblyLooseUnits(BlockBits units, int max_units) {
  BlockBits in_doubt = {};
  while (units != BlockBits{}) {
    const BlockBits piece = firstPiece(units);
    const bool is_small = isSmall(piece, max_units);
    for (size_t z = 0; z < kBlockSide; ++z) {
      units[z] &= ~piece[z];
      if (is_small) in_doubt[z] |= piece[z];
    }
  }
  return in_doubt;
}

/// The units of a row that hold a surface.
uint16_t surfaceInRow(const LabelNeighbourhood& labels, int row) {
  uint32_t bits = 0;
  for (int first = 0; first < kWindowSide; first += 4) {
    const CornerSource source = unitSource(firstOfRow(row) + gridStep(0, first));
    if (labels[source.block] == nullptr) continue;
    uint64_t four;
    std::memcpy(&four, labels[source.block] + source.voxel, sizeof(four));
    bits |= surfaceBits(four) << first;
  }
  return static_cast<uint16_t>(bits);
}

}  // namespace

BlockBits looseUnits(const BlockBits& surface, const LabelNeighbourhood& labels, int max_units) {
  if (max_units == 0) return {};
  BlockBits loose = possiblyLooseUnits(surface, max_units);
  if (loose == BlockBits{}) return loose;
  LooseWindow window = {};
  const SequentialRows rows;
  rows.each([&](int row) { window.surface[row] = surfaceInRow(labels, row); });
  const auto visitOwnRows = [&](const auto& visit) {
    for (int i = 0; i < kVoxelsPerBlock; i += kBlockSide) {
      const Vec3i first = voxelOffset(i);
      visit(loose[first.z], kBlockSide * first.y, windowRow(first.y, first.z));
    }
  };
  visitOwnRows([&](uint64_t layer, int shift, int row) {
    window.left[row] = static_cast<uint16_t>((layer >> shift & 0xffu) << kMaxLooseUnits);
  });
  LoosePieces(rows, labels, max_units, window).find();
  loose = {};
  visitOwnRows([&](uint64_t& layer, int shift, int row) {
    layer |= uint64_t{window.small[row] >> kMaxLooseUnits & 0xffu} << shift;
  });
  return loose;
}

}  // namespace dtsdf
