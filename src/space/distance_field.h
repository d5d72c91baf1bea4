/// Exact Euclidean distances between cells, up to a reach, kept up to date where surfaces change.
///
/// The squared distance to the nearest cell with a surface is a minimum of squares along x, of that
/// along y, and of that along z (Saito and Toriwaki, Pattern Recognition 27, 1994): whole numbers,
/// so that any order of work gives the same. It is worked out by tiles; a tile that lies within
/// reach of a change is worked out again from the surfaces around it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "space/cell_table.h"

namespace dtsdf {

/// Cubes by packed key.
using CubeSet = std::unordered_set<PackedKey>;

class DistanceField {
 public:
  /// Distances are known up to so many cells, 255 at most: their squares are kept in 16 bits.
  static constexpr int kMostReach = 255;

  DistanceField(int reach, int threads) : reach_(reach), threads_(threads) {}

  /// Takes over new surfaces; `changed` are the cubes in which there are other ones than at the
  /// last call.
  void update(const CellTable& cells, const CubeSet& changed);

  /// To the nearest cell with a surface; -1 if there is none within reach.
  int squaredAt(const Vec3i& cell) const;

  void clear() { tiles_.clear(); }
  size_t bytes() const;

 private:
  using Tile = std::vector<uint16_t>;  ///< Squared distances, x fastest; empty: all are far.

  std::vector<PackedKey> tilesNear(const CubeSet& cubes) const;

  const int reach_;
  const int threads_;
  std::unordered_map<PackedKey, Tile> tiles_;
};

}  // namespace dtsdf
