/// The stages "cast" and "fold" on the CPU: the surfels of a frame into the sums of one block, and
/// these into its voxels.
#pragma once

#include "cpu/find_blocks.h"
#include "cpu/voxel_store.h"

namespace dtsdf {

/// Voxels of a block, a bit each.
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

/// The sums of one block over one frame; one per thread. Folding leaves them zero for the next
/// block.
struct BlockSums {
  VoxelSums voxel[kDirectionCount][kVoxelsPerBlock];
  VoxelSet covered[kDirectionCount];  ///< Those with a weight; see findCovered().
};

/// Once all is added to the sums of a direction.
void findCovered(BlockSums& sums, int direction);

/// Adds those parts of surfels that lie in the block.
void cast(const TouchedBlock& block, const BlockFinder& finder, const FusionSettings& fusion,
          BlockSums& sums);

/// Voxel projection: each voxel takes the pixel that it falls on.
void project(const TouchedBlock& block, const std::vector<Surfel>& surfels, const FrameView& frame,
             const FusionSettings& fusion, BlockSums& sums);

/// Folds the sums of those directions (one bit each) that the block has an array of, and zeroes the
/// sums of all of them.
/// @return those of them whose arrays hold nothing.
uint32_t fold(BlockSums& sums, uint32_t directions, const BlockEntry& entry, float depth_weight,
              const FusionSettings& fusion, VoxelStore& voxels);

}  // namespace dtsdf
