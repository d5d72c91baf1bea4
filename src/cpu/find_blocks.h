/// The stage "find blocks" on the CPU: the surfels of a frame sorted by the blocks that they touch,
/// so that each block is then processed by one thread on its own: no atomics, and sums that stay in
/// the cache.
#pragma once

#include <unordered_map>
#include <vector>

#include "kernels/fusion/cast.h"
#include "map/block_table.h"

namespace dtsdf {

/// What casting needs of a line, in one line of the cache: surfels of a block lie apart in memory.
struct alignas(64) KeptLine {
  SampleLine line;
  float weight[3];     ///< One per direction.
  uint8_t directions;  ///< A bit each.
  bool has_sides;      ///< Which are kept apart: those of narrow pixels have none.
};
static_assert(sizeof(KeptLine) == 64, "");

/// A block that a frame touches.
struct TouchedBlock {
  Vec3i block_L;        ///< Coordinates relative to the frame's origin.
  PackedKey key;        ///< Coordinates in the map.
  uint32_t directions;  ///< Bit d: some surfel belongs to direction d.
  std::vector<const std::vector<uint32_t>*> surfels;  ///< Lists of their numbers.
};

class LineBatch;

class BlockFinder {
 public:
  BlockFinder(const FusionSettings& fusion, int threads) : fusion_(fusion), threads_(threads) {}

  /// Finds the blocks that the surfels of some lists touch, numbered from the first list on.
  void findBlocks(const std::vector<std::vector<Surfel>>& lists, const FrameSensing& sensing);

  /// Those that were found last.
  const std::vector<TouchedBlock>& touched() const { return touched_; }

  /// Line of a surfel, and its sides, if it has any; those of surfels without a weight hold
  /// nothing.
  const KeptLine& line(uint32_t surfel) const { return lines_[surfel]; }
  const MeasuredSides& sides(uint32_t surfel) const { return sides_[surfel]; }

  /// Memory of the lists of surfels and their lines, by far the most of it.
  size_t bytes() const;

 private:
  struct Bin {
    Vec3i block_L;
    PackedKey key;
    uint32_t directions;
    std::vector<uint32_t> surfels;
  };
  /// One thread's share; the buffers are kept from frame to frame.
  class Share {
   public:
    void reset();
    Bin& find(const Vec3i& block_L, const Vec3i& origin_block);

    std::vector<Bin> bins;  ///< Those of the last frame first.
    size_t used = 0;        ///< So many.

   private:
    static constexpr int kCacheSize = 64;
    Vec3i cached_block_L_[kCacheSize];
    size_t cached_bin_[kCacheSize];
    std::unordered_map<PackedKey, size_t> index_;
  };

  void addLines(const FrameSensing& sensing, LineBatch& batch, Share& share);
  void merge();

  const FusionSettings fusion_;
  const int threads_;
  std::vector<KeptLine> lines_;  ///< Lines of the last frame, and room for more.
  std::vector<MeasuredSides> sides_;
  std::vector<Share> shares_;
  std::vector<TouchedBlock> touched_;
};

}  // namespace dtsdf
