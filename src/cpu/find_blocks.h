/// The "find blocks" stage on the CPU: groups a frame's surfels by the blocks that they touch. Each
/// block is then processed by one thread, which needs no atomics and keeps the block's sums in the
/// CPU cache.
#pragma once

#include <unordered_map>
#include <vector>

#include "kernels/fusion/cast.h"
#include "map/block_table.h"

namespace dtsdf {

/// The data required to cast a surfel. Fits in one cache line, as the surfels of a block are
/// scattered in memory.
struct alignas(64) StoredLine {
  SampleLine line;
  float weight[3];     ///< One per direction.
  uint8_t directions;  ///< One bit each.
  bool has_sides;      ///< Whether BlockFinder::sides() is defined for this surfel.
};
static_assert(sizeof(StoredLine) == 64, "");

struct TouchedBlock {
  Vec3i block_L;        ///< Coordinates relative to the frame's origin.
  PackedKey key;        ///< Coordinates in the map.
  uint32_t directions;  ///< Bit d: a surfel belongs to direction d.
  std::vector<const std::vector<uint32_t>*> surfels;  ///< Lists of surfel indices.
};

class LineBatch;

class BlockFinder {
 public:
  BlockFinder(const FusionSettings& fusion, int threads) : fusion_(fusion), threads_(threads) {}

  /// Finds the blocks touched by the surfels in these lists. Surfel indices are consecutive over
  /// all lists.
  void findBlocks(const std::vector<std::vector<Surfel>>& lists, const FrameSensing& sensing);

  /// The blocks found by the last findBlocks().
  const std::vector<TouchedBlock>& touched() const { return touched_; }

  /// The line of a surfel; undefined if the surfel has no weight.
  const StoredLine& line(uint32_t surfel) const { return lines_[surfel]; }
  /// How far the surface was measured around a surfel; undefined unless line(surfel).has_sides.
  const MeasuredSides& sides(uint32_t surfel) const { return sides_[surfel]; }

  /// Memory used by lines, sides and surfel lists; the rest is small.
  size_t bytes() const;

 private:
  struct Bin {
    Vec3i block_L;
    PackedKey key;
    uint32_t directions;
    std::vector<uint32_t> surfels;
  };
  /// One thread's surfels, grouped by block. The memory is reused for each frame.
  class Share {
   public:
    void reset();
    Bin& find(const Vec3i& block_L, const Vec3i& origin_block);

    std::vector<Bin> bins;  ///< Only the first `used` bins belong to the last frame.
    size_t used = 0;

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
  std::vector<StoredLine> lines_;  ///< Lines of the last frame, possibly followed by unused ones.
  std::vector<MeasuredSides> sides_;
  std::vector<Share> shares_;
  std::vector<TouchedBlock> touched_;
};

}  // namespace dtsdf
