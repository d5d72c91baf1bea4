/// The stage "clear" on the device: takes evidence from what a frame contradicts, and lists arrays
/// that become empty.
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

  /// Makes room for a frame with `in_view` blocks in view. @throws BackendError if memory runs out;
  /// the map is not changed.
  void reserve(const FrameCounters& counters, size_t in_view);

  /// Notes which blocks may be in the frame's view: their slots, and possibly others.
  /// @pre reserve() has made room.
  void noteInView(const DeviceSensing& sensing, const std::vector<int32_t>& in_view);

  /// Enqueues the search for the blocks that the frame with this number looks at without touching
  /// them. Must follow the fold directly; the two may overlap.
  void findLooks(const DeviceSensing& sensing, const MapView& map, const TouchedView& touched,
                 uint64_t frame_number);

  /// Takes evidence from what the frame contradicts, marks changed blocks for meshing, and lists
  /// empty arrays.
  /// @param covered See Fusion::covered(), of the frame's fold.
  void clear(const DeviceSensing& sensing, const MapView& map, const TouchedView& touched,
             const FrameCounters& counters, const uint32_t* covered, uint64_t frame_number);

  /// Waits for the frame. @return its blocks with empty arrays, sorted by slot. Reports them only
  /// once.
  std::vector<EmptyBlock> takeEmptyBlocks();
  bool hasOutcome() const { return is_cleared_; }  ///< Its empty blocks were not taken yet.

  void addMemory(MapperMemory& memory) const;

 private:
  const bool looks_around_;  ///< False for voxel projection.
  const FusionSettings fusion_;
  const Stream& stream_;
  Event cleared_;
  const int thread_blocks_;        ///< Enough to fill the device: kernels work in strides.
  bool is_cleared_ = false;        ///< A frame's empty blocks have not been taken yet.
  PinnedBuffer<int32_t> in_view_;  ///< Read in place by kernels.
  uint32_t in_view_count_ = 0;     ///< Of the last frame; 0: it does not look around.
  DeviceBuffer<int32_t> looks_;
  PinnedBuffer<EmptyBlock> empty_blocks_;  ///< Written in place by kernels.
  PinnedBuffer<uint32_t> empty_count_{1};
};

/// Empties the blocks' voxels in a region, which is in units of voxels, with their colours, and
/// waits.
/// @return what was emptied in each block.
/// @throws BackendError if memory runs out; the map is not changed then.
std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots, const RegionView& region,
                                      const MapView& map, const Stream& stream);

}  // namespace gpu
}  // namespace dtsdf
