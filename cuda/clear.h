/// The stage "clear" on the device: what a frame contradicts, and what it leaves empty.
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

  /// Makes room for a frame with so many blocks in view. @throws BackendError without memory; the
  /// map is untouched.
  void reserve(const FrameCounters& counters, size_t in_view);

  /// The frame's turn: slots of blocks that may be in view, and others.
  /// @pre reserve() made the room.
  void noteInView(const DeviceSensing& sensing, const std::vector<int32_t>& in_view);

  /// Enqueues the search for the blocks that the frame of this number looks at without touching
  /// them; right behind the fold, beside which it may run.
  void findLooks(const DeviceSensing& sensing, const FusionTarget& target, uint64_t frame_number);

  /// Takes evidence from what the frame contradicts, marks what has changed for the mesh, and lists
  /// arrays that hold nothing.
  /// @param covered What the frame's fold found, as Fusion::covered() has it.
  void clear(const DeviceSensing& sensing, const FusionTarget& target,
             const FrameCounters& counters, const uint32_t* covered, uint64_t frame_number);

  /// Waits for the frame. @return its empty blocks, by slot; reported once.
  std::vector<EmptyBlock> takeEmptyBlocks();
  bool hasOutcome() const { return is_cleared_; }  ///< A frame's empty blocks were not taken yet.

  void addMemory(MapperMemory& memory) const;

 private:
  const bool looks_around_;  ///< Voxel projection does not.
  const FusionSettings fusion_;
  const Stream& stream_;
  Event cleared_;
  const int thread_blocks_;  ///< That fill the device, for kernels whose work is counted there.
  bool is_cleared_ = false;  ///< A frame's empty blocks have not been taken yet.
  PinnedBuffer<int32_t> in_view_;  ///< Kernels read it in place,
  uint32_t in_view_count_ = 0;     ///< of the last frame; 0: it does not look around.
  DeviceBuffer<int32_t> looks_;
  PinnedBuffer<EmptyBlock> empty_blocks_;  ///< and write these there.
  PinnedBuffer<uint32_t> empty_count_{1};
};

/// Empties the blocks' voxels in a region in units of voxels, with their colours, and waits.
/// @return what became of each. @throws BackendError without memory; the map is untouched then.
std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots, const RegionView& region,
                                      const MapView& map, const Stream& stream);

}  // namespace gpu
}  // namespace dtsdf
