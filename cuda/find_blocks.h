/// The stage "find blocks" on the device: finds the blocks in which a frame updates voxels (touched
/// blocks), compares them with the map, and requests missing blocks and arrays.
#pragma once

#include "device_map.h"
#include "dtsdf_mapping/mapper.h"
#include "kernels/fusion/fusion_rules.h"
#include "make_surfels.h"

namespace dtsdf {
namespace gpu {

/// Counters of one frame, for the host.
struct FrameCounters {
  uint32_t usable_surfels;  ///< Number of surfels; with voxel projection, only those with a weight.
  uint32_t touched;         ///< Touched blocks.
  uint32_t touched_arrays;  ///< Touched directions, summed over all blocks.
  uint32_t requests;        ///< Blocks that are missing or lack arrays.
  uint32_t requested_arrays;
  /// Not 0 if the table was too small; then only usable_surfels is exact.
  uint32_t table_full;
  uint32_t untouched;          ///< Untouched blocks that the frame checks.
  uint32_t empty_blocks;       ///< Blocks with empty arrays.
  uint32_t compared, cleared;  ///< Thread blocks that have finished comparing or clearing.
};

struct TouchedBlock {
  PackedKey key;
  Vec3i block_L;        ///< Coordinates relative to the frame's origin.
  uint32_t directions;  ///< Bit d: some surfel belongs to direction d.
  int32_t slot;         ///< -1 if the block was not in the map before the frame.
  uint32_t empty;       ///< Bit d: after fusion, the array of direction d is empty.
};

/// The list of blocks that the frame touches, and a hash table from their keys to their directions
/// and first arrays of sums. The table has two entries per block of its capacity.
struct TouchedView {
  PackedKey* keys;
  uint32_t* directions;
  uint32_t* first_sums;
  uint32_t mask;
  uint32_t capacity;  ///< In blocks.
  uint32_t* places;   ///< Per block: index of its entry in the table.
  TouchedBlock* blocks;
  uint32_t* sum_owners;  ///< Per array of sums: 8 * block + direction.
  FrameCounters* counters;
};

class BlockFinder {
 public:
  BlockFinder(const FusionSettings& fusion, const Stream& stream);

  /// Begins a frame: zeroes the counters and empties the table, unless prepare() has done so.
  void begin();

  /// Does the work of the next begin() ahead of time. Kernels enqueued after this call must not
  /// read the last frame's blocks.
  void prepare();
  uint32_t* usableSurfels() { return &counters_.data()->usable_surfels; }

  /// Enqueues the search for touched blocks.
  void mark(const DeviceSensing& sensing, const DeviceSurfels& surfels);

  /// Enqueues the comparison with the map, and the read-back of the counters.
  void compare(const DeviceSensing& sensing, const MapView& map);

  const FrameCounters& waitForCounters();

  /// Enlarges the table and zeroes all counters but `usable_surfels`. Call this if `table_full` is
  /// set, then repeat the steps from mark() on.
  void grow();

  /// The requested blocks and arrays. @pre waitForCounters() was called.
  std::vector<BlockRequest> fetchRequests() const;

  /// The keys of the touched blocks. Waits for the result.
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
  // Pinned host memory that kernels write directly.
  PinnedBuffer<FrameCounters> pinned_counters_;
  PinnedBuffer<BlockRequest> requests_;
  PinnedBuffer<PackedKey> touched_keys_;
};

}  // namespace gpu
}  // namespace dtsdf
