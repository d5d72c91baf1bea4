/// Fusion of a frame into the voxels of the blocks that it touches.
#pragma once

#include "dtsdf_mapping/params/fusion_params.h"
#include "touched_blocks.h"

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

class Fusion {
 public:
  explicit Fusion(const Stream& stream) : stream_(stream) {}

  /// Makes room for a frame. @throws CudaError without memory; the map is untouched.
  void reserve(const FrameCounters& counters, FusionMode mode);

  /// Casts all surfels into the frame's sums, and folds those into the voxels.
  void castSurfels(const FusionInput& input, const MapView& map, const TouchedView& touched,
                   const FrameCounters& counters);

  /// Voxel projection: every voxel of the touched blocks takes the distance of its pixel.
  void projectVoxels(const FusionInput& input, const MapView& map, const TouchedView& touched,
                     const FrameCounters& counters);

  /// Takes weight from what the frame saw as free, marks what has changed for the mesh, and lists new
  /// arrays that hold nothing. `new_blocks` is the number of blocks that were given arrays for this
  /// frame.
  void finish(const FusionInput& input, const MapView& map, const TouchedBlocks& touched,
              const FrameCounters& counters, size_t new_blocks);

  /// Waits for the frame, and tells its empty blocks, by slot. Tells them once.
  std::vector<EmptyBlock> takeEmptyBlocks();

  void addMemory(std::vector<MemoryPart>& parts) const;

 private:
  void reserveSums(uint32_t arrays);

  const Stream& stream_;
  Event finished_;
  bool has_new_blocks_ = false;
  DeviceBuffer<VoxelSums> sums_;  ///< All zero between frames.
  DeviceBuffer<EmptyBlock> empty_blocks_;
  PinnedBuffer<EmptyBlock> pinned_empty_blocks_;
  PinnedBuffer<FrameCounters> pinned_counters_{1};
};

}  // namespace gpu
}  // namespace dtsdf
