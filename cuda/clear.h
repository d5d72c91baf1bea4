/// The stage "clear" on the device: reduces the evidence of voxels that a frame looks through,
/// and lists arrays that become empty.
#pragma once

#include <vector>

#include "fusion.h"
#include "kernels/core/region.h"
#include "map/block_table.h"

namespace dtsdf {
namespace gpu {

class Clearing {
 public:
  Clearing(const MapperParams& params, const Rules& rules, const Stream& stream);

  /// Reserves memory for a frame with `in_view` blocks in view. @throws BackendError if memory runs
  /// out; the map is not changed.
  void reserve(const FrameCounters& counters, size_t in_view);

  /// Stores the blocks that the frame may check. @pre reserve() was called.
  /// @param in_view Slots of all blocks that may be in view, and possibly of other blocks.
  void storeInView(const DeviceSensing& sensing, const std::vector<int32_t>& in_view);

  /// Enqueues the search for blocks that the frame checks but does not update (untouched blocks).
  /// Call this directly after Fusion::castAndFold(), whose last kernel may still be running.
  void findBlocksToCheck(const DeviceSensing& sensing, const MapView& map,
                         const TouchedView& touched, uint64_t frame_number);

  /// Enqueues the stage, which also marks touched and changed blocks for meshing.
  /// @param covered Result of Fusion::covered() for this frame.
  void clear(const DeviceSensing& sensing, const MapView& map, const TouchedView& touched,
             const FrameCounters& counters, const uint32_t* covered, uint64_t frame_number);

  /// Waits for the last frame. @return the blocks with empty arrays, in ascending order of slots. A
  /// second call for the same frame returns an empty list.
  std::vector<EmptyBlock> takeEmptyBlocks();
  bool hasOutcome() const { return is_cleared_; }

  void addMemory(MapperMemory& memory) const;

 private:
  const bool clears_;  ///< False with voxel projection.
  const FusionSettings fusion_;
  const Stream& stream_;
  Event cleared_;
  const int thread_blocks_;        ///< Enough to fill the device.
  bool is_cleared_ = false;        ///< Whether takeEmptyBlocks() is due.
  PinnedBuffer<int32_t> in_view_;  ///< Read in place by kernels.
  uint32_t in_view_count_ = 0;  ///< Number of slots in in_view_; 0 if the frame clears no voxels.
  DeviceBuffer<int32_t> looks_;
  PinnedBuffer<EmptyBlock> empty_blocks_;  ///< Written in place by kernels.
  PinnedBuffer<uint32_t> empty_count_{1};
};

/// Empties the voxels of the given blocks that lie in a region, removes their colours, and waits
/// for the device.
/// @return the effect on each block.
/// @throws BackendError if memory runs out; the map is not changed then.
std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots, const RegionView& region,
                                      const MapView& map, const Stream& stream);

}  // namespace gpu
}  // namespace dtsdf
