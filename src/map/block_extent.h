/// Boxes of blocks, to which a map is restricted if it is one tile of a larger map.
#pragma once

#include "kernels/core/grid.h"

namespace dtsdf {

/// Blocks from `first` to `last` (inclusive) along each axis; empty if `first` exceeds `last` along
/// any axis.
struct BlockExtent {
  BlockKey first = {-kMaxBlockCoordinate, -kMaxBlockCoordinate, -kMaxBlockCoordinate};
  BlockKey last = {kMaxBlockCoordinate, kMaxBlockCoordinate, kMaxBlockCoordinate};

  DTSDF_HD bool contains(const BlockKey& key) const {
    return first.x <= key.x && key.x <= last.x && first.y <= key.y && key.y <= last.y &&
           first.z <= key.z && key.z <= last.z;
  }
};

/// Whether any block lies in both boxes.
inline bool overlap(const BlockExtent& a, const BlockExtent& b) {
  return a.first.x <= b.last.x && b.first.x <= a.last.x && a.first.y <= b.last.y &&
         b.first.y <= a.last.y && a.first.z <= b.last.z && b.first.z <= a.last.z;
}

/// Smallest box around both; one of them may be noBlocks().
inline BlockExtent around(const BlockExtent& a, const BlockExtent& b) {
  return {minOf(a.first, b.first), maxOf(a.last, b.last)};
}

inline BlockExtent intersectionOf(const BlockExtent& a, const BlockExtent& b) {
  return {maxOf(a.first, b.first), minOf(a.last, b.last)};
}

/// Extends a box by `before` blocks at its lower faces and `behind` blocks at its upper faces.
inline BlockExtent grown(const BlockExtent& box, int32_t before, int32_t behind) {
  return {box.first - Vec3i{before, before, before}, box.last + Vec3i{behind, behind, behind}};
}

/// Number of blocks along each axis.
inline Vec3i edgesOf(const BlockExtent& box) { return box.last - box.first + Vec3i{1, 1, 1}; }

/// Number of blocks, which fits in 63 bits for any box.
inline uint64_t volumeOf(const BlockExtent& box) {
  const Vec3i edges = edgesOf(box);
  return static_cast<uint64_t>(edges.x) * static_cast<uint64_t>(edges.y) *
         static_cast<uint64_t>(edges.z);
}

/// A box without blocks, empty along every axis.
inline BlockExtent noBlocks() { return {BlockExtent().last, BlockExtent().first}; }
/// Whether a box is empty. @pre It is empty along every axis or along none.
inline bool holdsNothing(const BlockExtent& box) { return box.first.x > box.last.x; }

/// Boxes to which a map is restricted.
struct MapExtent {
  BlockExtent blocks;   ///< Blocks that may be created.
  BlockExtent painted;  ///< Blocks that may be painted; other blocks only occlude surfaces.
  BlockExtent cubes;    ///< Cubes of free-space cells, as a box of cube keys.
};

}  // namespace dtsdf
