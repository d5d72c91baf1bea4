#include "cpu/loose_units.h"

#include <algorithm>
#include <cstring>

namespace dtsdf {
namespace {

/// One thread works on rows of the window, whose places along y and z are given from the block's
/// first one.
class RowsInTurn {
 public:
  static constexpr bool kAtOnce = false;
  RowsInTurn(int first, int end) : first_(first), end_(end) {}

  template <class Visit>
  void each(const Visit& visit) const {
    for (int z = first_; z < end_; ++z) eachOfLayer(z, visit);
  }
  template <class Bits>
  int firstOf(const Bits& bits) const {
    for (int z = first_; z < end_; ++z) {
      for (int y = first_; y < end_; ++y) {
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
    for (int z = std::max(low_ - 1, first_); z < std::min(high_ + 2, end_); ++z) {
      eachOfLayer(z, visit);
    }
  }
  /// A row for which it is true has grown, or those beside it.
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
    for (int y = first_; y < end_; ++y) visit(windowRow(y, z));
  }

  const int first_, end_;
  mutable int low_ = 0, high_ = 0;  ///< Layers that the piece may have units in.
};

/// Calls visit(row of the window, units of a layer, their place there) for the rows of the block.
template <class Layers, class Visit>
void visitOwnRows(Layers& layers, const Visit& visit) {
  for (int z = 0; z < kBlockSide; ++z) {
    for (int y = 0; y < kBlockSide; ++y) visit(windowRow(y, z), layers[z], kBlockSide * y);
  }
}

/// Which units of a row hold a surface.
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

/// In most blocks the block by itself shows that it has none.
BlockBits looseUnits(const BlockBits& surface, const LabelNeighbourhood& labels, int most_units) {
  BlockBits loose = {};
  if (most_units == 0) return loose;
  LooseWindow window = {};
  visitOwnRows(surface, [&](int row, uint64_t layer, int at) {
    window.surface[row] = static_cast<uint16_t>((layer >> at & 0xffu) << kMostLooseUnits);
  });
  const RowsInTurn own(0, kBlockSide), all(-kMostLooseUnits, kBlockSide + kMostLooseUnits);
  if (!LoosePieces(own, labels, most_units, window).findSmall()) return loose;
  all.each([&](int row) { window.surface[row] = surfaceInRow(labels, row); });
  LoosePieces(all, labels, most_units, window).find();
  visitOwnRows(loose, [&](int row, uint64_t& layer, int at) {
    layer |= uint64_t{window.small[row] >> kMostLooseUnits & 0xffu} << at;
  });
  return loose;
}

}  // namespace dtsdf
