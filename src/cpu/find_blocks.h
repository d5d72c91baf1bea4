/// The stage "find blocks" on the CPU: sorts a frame's surfels by the blocks that they touch. Each
/// block can then be processed by a single thread, without atomics and with sums that stay in the
/// cache.
#pragma once

#include <unordered_map>
#include <vector>

#include "kernels/fusion/cast.h"
#include "map/block_table.h"

namespace dtsdf {

/// The data of a surfel that casting needs, in one cache line, since a block's surfels are
/// scattered in memory.
struct alignas(64) StoredLine {
  SampleLine line;
  float weight[3];     ///< One per direction.
  uint8_t directions;  ///< One bit each.
  bool has_sides;      ///< See BlockFinder::sides(); narrow pixels have no sides.
};
static_assert(sizeof(StoredLine) == 64, "");

struct TouchedBlock {
  Vec3i block_L;        ///< Coordinates relative to the frame's origin.
  PackedKey key;        ///< Coordinates in the map.
  uint32_t directions;  ///< Bit d: a surfel belongs to direction d.
  std::vector<const std::vector<uint32_t>*> surfels;  ///< Lists of surfel numbers.
};

class LineBatch;

class BlockFinder {
 public:
  BlockFinder(const FusionSettings& fusion, int threads) : fusion_(fusion), threads_(threads) {}

  /// Finds the blocks touched by the surfels of these lists. Surfels are numbered consecutively
  /// through all lists.
  void findBlocks(const std::vector<std::vector<Surfel>>& lists, const FrameSensing& sensing);

  /// The blocks from the last findBlocks().
  const std::vector<TouchedBlock>& touched() const { return touched_; }

  /// The line of a surfel; undefined if the surfel has no weight.
  const StoredLine& line(uint32_t surfel) const { return lines_[surfel]; }
  /// The sides of a surfel; undefined unless line(surfel).has_sides.
  const MeasuredSides& sides(uint32_t surfel) const { return sides_[surfel]; }

  /// Memory of lines, sides and lists of surfels; the rest is small.
  size_t bytes() const;

 private:
  struct Bin {
    Vec3i block_L;
    PackedKey key;
    uint32_t directions;
    std::vector<uint32_t> surfels;
  };
  /// The bins of one thread's share of the surfels, reused for each frame.
  class Share {
   public:
    void reset();
    Bin& find(const Vec3i& block_L, const Vec3i& origin_block);

    std::vector<Bin> bins;  ///< Bins of the last frame come first.
    size_t used = 0;        ///< Number of bins of the last frame.

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
  std::vector<StoredLine> lines_;  ///< Lines of the last frame, possibly followed by older ones.
  std::vector<MeasuredSides> sides_;
  std::vector<Share> shares_;
  std::vector<TouchedBlock> touched_;
};

}  // namespace dtsdf
