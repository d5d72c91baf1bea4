/// The stages "cast" and "fold" on the CPU: cast a frame's surfels into the sums of a block, and
/// fold these into its voxels.
#pragma once

#include "cpu/find_blocks.h"
#include "cpu/voxel_store.h"

namespace dtsdf {

/// A set of a block's voxels, a bit each.
struct VoxelSet {
  static constexpr int kWordBits = 64, kWords = kVoxelsPerBlock / kWordBits;
  uint64_t word[kWords];

  /// The bits of a row along x.
  uint32_t row(int number) const {
    static_assert(kWordBits == kBlockSide * kBlockSide, "a layer each");
    return word[number / kBlockSide] >> (number % kBlockSide * kBlockSide) & 255u;
  }
  template <class Visit>
  void forEach(const Visit& visit) const {
    for (int i = 0; i < kWords; ++i) {
      for (uint64_t rest = word[i]; rest != 0; rest &= rest - 1) {
        visit(i * kWordBits + __builtin_ctzll(rest));
      }
    }
  }
};

/// A frame's sums for one block; one per thread. Folding resets them to zero for the next block.
struct BlockSums {
  VoxelSums voxel[kDirectionCount][kVoxelsPerBlock];
  VoxelSet covered[kDirectionCount];  ///< Voxels with a weight; see findCovered().
};

/// Finds the covered voxels of a direction. @pre Its sums are complete.
void findCovered(BlockSums& sums, int direction);

/// Adds the parts of surfels that are in the block to its sums.
void cast(const TouchedBlock& block, const BlockFinder& finder, const FusionSettings& fusion,
          BlockSums& sums);

/// Voxel projection: each voxel uses the pixel that it falls on.
void project(const TouchedBlock& block, const std::vector<Surfel>& surfels, const FrameView& frame,
             const FusionSettings& fusion, BlockSums& sums);

/// Folds the sums of `directions` (a bit each) for which the block has an array, and resets the
/// sums of all of them.
/// @return the directions whose arrays are empty afterwards.
uint32_t fold(BlockSums& sums, uint32_t directions, const BlockEntry& entry, float depth_weight,
              const FusionSettings& fusion, VoxelStore& voxels);

}  // namespace dtsdf
