/// Boxes of blocks: what a map is restricted to that is one tile of a larger one.
#pragma once

#include "kernels/core/grid.h"

namespace dtsdf {

/// From `first` up to and with `last`, along each axis; none where a first one is beyond the last.
struct BlockExtent {
  BlockKey first = {-kMaxBlockCoordinate, -kMaxBlockCoordinate, -kMaxBlockCoordinate};
  BlockKey last = {kMaxBlockCoordinate, kMaxBlockCoordinate, kMaxBlockCoordinate};

  DTSDF_HD bool contains(const BlockKey& key) const {
    return first.x <= key.x && key.x <= last.x && first.y <= key.y && key.y <= last.y &&
           first.z <= key.z && key.z <= last.z;
  }
};

/// Whether any block lies in both.
inline bool overlap(const BlockExtent& a, const BlockExtent& b) {
  return a.first.x <= b.last.x && b.first.x <= a.last.x && a.first.y <= b.last.y &&
         b.first.y <= a.last.y && a.first.z <= b.last.z && b.first.z <= a.last.z;
}

/// The least box around both; one of them may be noBlocks().
inline BlockExtent around(const BlockExtent& a, const BlockExtent& b) {
  return {leastOf(a.first, b.first), greatestOf(a.last, b.last)};
}

/// What lies in both.
inline BlockExtent inBoth(const BlockExtent& a, const BlockExtent& b) {
  return {greatestOf(a.first, b.first), leastOf(a.last, b.last)};
}

/// So many blocks more before the first ones and behind the last ones, along each axis.
inline BlockExtent grown(const BlockExtent& box, int32_t before, int32_t behind) {
  return {box.first - Vec3i{before, before, before}, box.last + Vec3i{behind, behind, behind}};
}

/// How many blocks it has along each axis.
inline Vec3i edgesOf(const BlockExtent& box) { return box.last - box.first + Vec3i{1, 1, 1}; }

/// In blocks: that of all of space has 63 bits.
inline uint64_t volumeOf(const BlockExtent& box) {
  const Vec3i edges = edgesOf(box);
  return static_cast<uint64_t>(edges.x) * static_cast<uint64_t>(edges.y) *
         static_cast<uint64_t>(edges.z);
}

/// One that contains nothing.
inline BlockExtent noBlocks() { return {BlockExtent().last, BlockExtent().first}; }
inline bool holdsNone(const BlockExtent& box) { return box.first.x > box.last.x; }

/// What a map has of what frames and images show.
struct MapExtent {
  BlockExtent blocks;   ///< Blocks that are made.
  BlockExtent painted;  ///< Blocks that take colour; the others only hide what is behind them.
  BlockExtent cubes;    ///< Cubes of space's cells, by their keys.
};

}  // namespace dtsdf
