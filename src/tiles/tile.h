/// A tile: a box of blocks that is fused by itself, and the frames that it needs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernels/space/cells.h"
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

/// A cube of cells of space is as wide as so many blocks, and belongs to the tile that its first
/// block belongs to: so each has one, and reaches beyond the tile by all but one of them.
constexpr int blocksPerCube(int cell_voxels) { return cell_voxels * kCubeSide / kBlockSide; }

/// The cubes of a tile, by their keys; none if it is too small for any.
inline BlockExtent cubesOf(const BlockExtent& own, int cell_voxels) {
  const int n = blocksPerCube(cell_voxels);
  const auto up = [n](int32_t x) { return -floorDivided(-x, n); };
  const auto down = [n](int32_t x) { return floorDivided(x, n); };
  return {{up(own.first.x), up(own.first.y), up(own.first.z)},
          {down(own.last.x), down(own.last.y), down(own.last.z)}};
}

/// The blocks that these cubes are as wide as.
inline BlockExtent withCubes(const BlockExtent& own, int cell_voxels) {
  const int beyond = blocksPerCube(cell_voxels) - 1;
  return {own.first, own.last + Vec3i{beyond, beyond, beyond}};
}

/// What the plan expects of a tile: bounds, as what is cleared on the way is not known.
struct TileEstimate {
  size_t blocks = 0, voxel_arrays = 0;   ///< At most, with all blocks that are fused.
  size_t own_blocks = 0;                 ///< Of these, at most.
  size_t map_bytes = 0, free_bytes = 0;  ///< In memory: blocks, colours; what is free.
  double seconds = 0.0;                  ///< As one process on the machine of the plan may take.
};

struct Tile {
  BlockExtent own;                  ///< The blocks that it makes for the whole map.
  BlockExtent fused;                ///< withHalo(own), and what may hide that from its images.
  std::vector<IndexRanges> frames;  ///< By recording: those that change blocks or cells here.
  std::vector<IndexRanges> images;  ///< By recording: those that may paint withHalo(own).
  TileEstimate estimate;

  size_t frameCount() const { return countOf(frames); }
  size_t imageCount() const { return countOf(images); }

 private:
  static size_t countOf(const std::vector<IndexRanges>& indices) {
    size_t count = 0;
    for (const IndexRanges& of_recording : indices) count += of_recording.count();
    return count;
  }
};

}  // namespace dtsdf
