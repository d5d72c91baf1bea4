/// The stage "find blocks" on the device: the blocks that a frame touches, compared with the map,
/// and turned into requests for what is missing.
#pragma once

#include "device_map.h"
#include "dtsdf_mapping/mapper.h"
#include "kernels/fusion/fusion_rules.h"
#include "make_surfels.h"

namespace dtsdf {
namespace gpu {

/// Counts of one frame; all that the host has to know of it.
struct FrameCounters {
  uint32_t usable_surfels;  ///< Surfels, but for those that have no weight for want of a normal.
  uint32_t touched;         ///< Blocks.
  uint32_t touched_arrays;  ///< Arrays that the frame's surfels belong to, over all blocks.
  uint32_t requests;        ///< Blocks that are missing or miss arrays.
  uint32_t requested_arrays;
  uint32_t table_full;         ///< Not 0: the table was too small, and the counts are not valid.
  uint32_t looks;              ///< Blocks that the frame looks at without touching them.
  uint32_t empty_blocks;       ///< Blocks with arrays that hold nothing.
  uint32_t compared, cleared;  ///< Blocks of threads that have finished these stages.
};

struct TouchedBlock {
  PackedKey key;
  Vec3i block_L;        ///< Coordinates relative to the frame's origin.
  uint32_t directions;  ///< Bit d: some surfel belongs to direction d.
  int32_t slot;         ///< -1: not in the map before the frame.
  uint32_t empty;       ///< Bit d: after the fold, the array of direction d holds nothing.
};

/// The frame's hash table (key to directions and to the block's first array of sums), and the list
/// of what is in it. The table has two places per block.
struct TouchedView {
  PackedKey* keys;
  uint32_t* directions;
  uint32_t* first_sums;
  uint32_t mask;
  uint32_t capacity;  ///< Blocks.
  uint32_t* places;   ///< Place in the table, per block.
  TouchedBlock* blocks;
  uint32_t* sum_owners;  ///< Per array of sums: 8 * block + direction.
  FrameCounters* counters;
};

class BlockFinder {
 public:
  BlockFinder(const FusionSettings& fusion, const Stream& stream);

  /// Begins a frame: zeroes the counters, empties the table, unless that was prepared.
  void begin();

  /// Prepares the next frame early, after all that looks at the last frame's blocks.
  void prepare();
  uint32_t* usableSurfels() { return &counters_.data()->usable_surfels; }

  /// Enqueues the search for touched blocks.
  void mark(const DeviceSensing& sensing, const DeviceSurfels& surfels);

  /// Enqueues the comparison with the map, and the read-back of the counters.
  void compare(const DeviceSensing& sensing, const MapView& map);

  /// Waits for the counters.
  const FrameCounters& waitForCounters();

  /// After counters with `table_full`: makes the table larger and zeroes the counters except
  /// that of surfels, for the steps from mark() on.
  void grow();

  /// The requests that were counted.
  std::vector<BlockRequest> fetchRequests() const;

  /// The keys of the touched blocks; waits for them.
  std::vector<PackedKey> fetchTouched();

  TouchedView view() const;
  void addMemory(MapperMemory& memory) const;

 private:
  void allocate(size_t capacity);
  void emptyTable(bool counts_surfels);

  const FusionSettings fusion_;
  const Stream& stream_;
  Event counted_;
  size_t capacity_ = 0;
  bool is_prepared_ = false;
  DeviceBuffer<PackedKey> keys_;
  DeviceBuffer<uint32_t> directions_, first_sums_, places_, sum_owners_;
  DeviceBuffer<TouchedBlock> blocks_;
  DeviceBuffer<FrameCounters> counters_;
  PinnedBuffer<FrameCounters> pinned_counters_;  ///< A kernel writes them there,
  PinnedBuffer<BlockRequest> requests_;          ///< and these,
  PinnedBuffer<PackedKey> touched_keys_;         ///< and these.
};

}  // namespace gpu
}  // namespace dtsdf
