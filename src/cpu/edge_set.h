/// A set of edges of a block's corner grid, visited in ascending order.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kernels/meshing/emit.h"

namespace dtsdf {

class EdgeSet {
 public:
  void clear() {
    for (uint64_t& word : bits_) word = 0;
  }

  void add(int edge) { bits_[edge / kWordBits] |= uint64_t{1} << edge % kWordBits; }

  /// Enters the edges that a unit's triangles have their corners on.
  void addUnit(const UnitIndices& indices, const Vec3i& unit) {
    visitTriangleEdges(kMeshTables, indices, unit, [this](int edge) { add(edge); });
  }

  template <class Visit>
  void forEach(const Visit& visit) const {
    for (int word = 0; word < kWords; ++word) {
      for (uint64_t rest = bits_[word]; rest != 0; rest &= rest - 1) {
        visit(word * kWordBits + __builtin_ctzll(rest));
      }
    }
  }

  size_t count() const {
    size_t edges = 0;
    for (const uint64_t word : bits_) edges += __builtin_popcountll(word);
    return edges;
  }

 private:
  static constexpr int kWordBits = 64;
  static constexpr int kWords = (kGridEdges + kWordBits - 1) / kWordBits;
  uint64_t bits_[kWords] = {};
};

}  // namespace dtsdf
