/// Exact Euclidean distances between cells, up to a reach, kept up to date where surfaces change.
///
/// They are kept by tiles of 32 x 32 x 32 cells, each of 64 parts of the size of a cube. A surface
/// that came can only make distances less, which is done where it does; one that went makes those
/// parts be worked out again in which some cell was nearest to it. That is done from the surfaces
/// around: the squared distance to the nearest one is a minimum of squares along x, of that along
/// y, and of that along z (Saito and Toriwaki, Pattern Recognition 27, 1994). All are whole
/// numbers, so that any order of work gives the same.
#pragma once

#include <array>
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

  /// Takes over new surfaces; `changed` are the cubes in which there may be other ones than at the
  /// last call.
  void update(const CellTable& cells, const CubeSet& changed);

  /// To the nearest cell with a surface; -1 if there is none within reach.
  int squaredAt(const Vec3i& cell) const;

  void clear();
  size_t bytes() const;

  static constexpr int kPartsPerTile = 64;

  /// Squared distances of a tile.
  struct Tile {
    std::vector<uint16_t> squared;  ///< Part by part, as cells of cubes; empty: all are far.
    std::array<uint16_t, kPartsPerTile> most;  ///< The greatest one in each part.
  };

  /// Surfaces that came and went in a cube.
  struct CubeChange {
    Vec3i cube;
    CellMask added, removed;
  };

 private:
  struct TileChange;

  std::vector<CubeChange> takeChanges(const CellTable& cells, const CubeSet& changed);
  std::vector<TileChange> tilesNear(const std::vector<CubeChange>& changes);
  template <class Value>
  void updateTiles(const CellTable& cells, const std::vector<TileChange>& tiles);

  const int reach_;
  const int threads_;
  std::unordered_map<PackedKey, Tile> tiles_;
  std::unordered_map<PackedKey, CellMask> surfaces_;  ///< That the tiles know of, by cube.
};

}  // namespace dtsdf
