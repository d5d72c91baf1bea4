/// A box of blocks: what a map is restricted to that is one tile of a larger one.
#pragma once

#include "kernels/core/grid.h"

namespace dtsdf {

/// From `first` up to and with `last`, along each axis; none where a first one is beyond the last.
struct BlockExtent {
  BlockKey first = {-kMaxBlockCoordinate, -kMaxBlockCoordinate, -kMaxBlockCoordinate};
  BlockKey last = {kMaxBlockCoordinate, kMaxBlockCoordinate, kMaxBlockCoordinate};

  bool contains(const BlockKey& key) const {
    return first.x <= key.x && key.x <= last.x && first.y <= key.y && key.y <= last.y &&
           first.z <= key.z && key.z <= last.z;
  }
};

/// One that contains nothing.
inline BlockExtent noBlocks() { return {{1, 1, 1}, {0, 0, 0}}; }

}  // namespace dtsdf
