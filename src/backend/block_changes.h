/// What stages report of blocks that lose something.
#pragma once

#include <cstdint>

namespace dtsdf {

/// A block of which arrays (bit d for direction d) hold nothing: new ones that turned out so, and
/// those that a frame emptied.
struct EmptyBlock {
  int32_t slot;
  uint32_t directions;
};

/// What a block lost in a region.
struct EmptiedBlock {
  uint32_t voxels;            ///< That held something.
  uint32_t empty_directions;  ///< Bit d: the array of direction d was emptied.
};

}  // namespace dtsdf
