/// The stages "cast", "fold" and "clear" on the device: a frame into the voxels of its blocks.
#pragma once

#include "backend/rules.h"
#include "find_blocks.h"

namespace dtsdf {
namespace gpu {

/// A block whose new arrays (bit d for direction d) turned out to hold nothing.
struct EmptyBlock {
  int32_t slot;
  uint32_t directions;
};

/// Sums of a part of a frame's arrays: those from `first` on.
struct SumsView {
  VoxelSums* sums;
  uint32_t first, count;
};

/// What the stages work on: the map, and the frame's blocks.
struct FusionTarget {
  MapView map;
  TouchedView touched;
};

class Fusion {
 public:
  Fusion(const MapperParams& params, const Rules& rules, const Stream& stream);

  /// Makes room for a frame. @throws CudaError without memory; the map is untouched.
  void reserve(const FrameCounters& counters);

  /// Casts all surfels into the frame's sums, and folds those into the voxels. Voxel projection
  /// does both at once.
  void castAndFold(const DeviceSensing& sensing, const DeviceSurfels& surfels,
                   const FusionTarget& target, const FrameCounters& counters);

  /// Takes weight from what the frame saw as free, marks what has changed for the mesh, and lists
  /// new arrays that hold nothing. `new_blocks` is the number of blocks that were given arrays for
  /// this frame.
  void clear(const DeviceSensing& sensing, const FusionTarget& target,
             const FrameCounters& counters, size_t new_blocks);

  /// Waits for the frame, and tells its empty blocks, by slot. Tells them once.
  std::vector<EmptyBlock> takeEmptyBlocks();

  void addMemory(std::vector<MemoryPart>& parts) const;

 private:
  void reserveSums(uint32_t arrays);
  void cast(const DeviceSensing& sensing, const DeviceSurfels& surfels, const TouchedView& touched,
            const SumsView& part);
  void fold(const FusionTarget& target, const SumsView& part);
  void project(const DeviceSensing& sensing, const DeviceSurfels& surfels,
               const FusionTarget& target, uint32_t blocks);

  const bool casts_;  ///< Else voxels are projected.
  const Rules rules_;
  const FusionSettings fusion_;
  const Stream& stream_;
  Event cleared_;
  bool has_new_blocks_ = false;
  DeviceBuffer<VoxelSums> sums_;  ///< All zero between frames.
  DeviceBuffer<EmptyBlock> empty_blocks_;
  PinnedBuffer<EmptyBlock> pinned_empty_blocks_;
  PinnedBuffer<FrameCounters> pinned_counters_{1};
};

}  // namespace gpu
}  // namespace dtsdf
