/// A tile: a box of blocks that is fused by itself, and the frames that it needs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "map/block_extent.h"
#include "tiles/index_ranges.h"

namespace dtsdf {

/// The mesh of a block depends on voxels of blocks around it, so many before it along an axis and
/// so many behind it: its units have corners in the next block, regularisation (regularisation.h)
/// asks the units around those corners, and bends and normals look one corner beyond the
/// ends of an edge: none of which is farther away than a block. No stage of fusion looks at another
/// block's voxels.
constexpr int kHaloBefore = 1, kHaloBehind = 1;

/// A tile's own blocks with those around that their meshes depend on.
inline BlockExtent withHalo(const BlockExtent& own) {
  return {own.first - Vec3i{kHaloBefore, kHaloBefore, kHaloBefore},
          own.last + Vec3i{kHaloBehind, kHaloBehind, kHaloBehind}};
}

/// What the plan expects of a tile: bounds, as what is cleared on the way is not known.
struct TileEstimate {
  size_t blocks = 0, voxel_arrays = 0;  ///< At most, halo included.
  size_t map_bytes = 0;                 ///< Of these, at most.
  double seconds = 0.0;                 ///< As one process on the machine of the plan may take.
};

struct Tile {
  BlockExtent own;                  ///< The blocks that it makes for the whole map.
  std::vector<IndexRanges> frames;  ///< By recording: images that change blocks of withHalo(own).
  TileEstimate estimate;

  size_t frameCount() const {
    size_t count = 0;
    for (const IndexRanges& of_recording : frames) count += of_recording.count();
    return count;
  }
};

}  // namespace dtsdf
