/// The stages "cast" and "fold" for one block on the CPU: they add a frame's surfels to the block's
/// sums, and merge the sums into the block's voxels.
#pragma once

#include "cpu/find_blocks.h"
#include "cpu/voxel_store.h"

namespace dtsdf {

/// A set of a block's voxels, with one bit per voxel and one word per layer.
struct VoxelSet {
  static constexpr int kWordBits = 64, kWords = kVoxelsPerBlock / kWordBits;
  uint64_t word[kWords];

  template <class Visit>
  void forEach(const Visit& visit) const {
    for (int i = 0; i < kWords; ++i) {
      for (uint64_t rest = word[i]; rest != 0; rest &= rest - 1) {
        visit(i * kWordBits + __builtin_ctzll(rest));
      }
    }
  }
};

/// A frame's sums for one block. Each thread reuses one instance; fold() resets it for the next
/// block.
struct BlockSums {
  VoxelSums voxel[kDirectionCount][kVoxelsPerBlock];
  VoxelSet covered[kDirectionCount];  ///< Voxels whose sums have a weight; see findCovered().
};

/// Finds the covered voxels of a direction from its sums.
void findCovered(BlockSums& sums, int direction);

/// Adds those samples of the surfels' lines that lie in the block to its sums.
void cast(const TouchedBlock& block, const BlockFinder& finder, const FusionSettings& fusion,
          BlockSums& sums);

/// The equivalent of cast() for voxel projection. Each voxel takes the surfel of the pixel to which
/// it projects.
void project(const TouchedBlock& block, const std::vector<Surfel>& surfels, const FrameView& frame,
             const FusionSettings& fusion, BlockSums& sums);

/// Folds the sums of those `directions` (one bit each) for which the block has an array, and resets
/// the sums of all `directions`.
/// @return the directions whose arrays are empty afterwards, one bit each.
uint32_t fold(BlockSums& sums, uint32_t directions, const BlockEntry& entry, float depth_weight,
              const FusionSettings& fusion, VoxelStore& voxels);

}  // namespace dtsdf
