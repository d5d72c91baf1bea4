/// The stages "cast", "fold" and "clear" on the device: a frame into the voxels of its blocks.
#pragma once

#include "backend/block_changes.h"
#include "backend/rules.h"
#include "find_blocks.h"

namespace dtsdf {
namespace gpu {

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

/// The blocks that a frame looks at besides those that it touches, and those among which they are;
/// FrameCounters counts them.
struct LookList {
  const int32_t* in_view;
  uint32_t in_view_count;
  int32_t* slots;
};

/// Where the host finds the blocks that a frame leaves empty, in its own memory.
struct EmptyList {
  EmptyBlock* blocks;
  uint32_t* count;
};

/// A frame's turn to look around.
struct LookTurn {
  uint64_t number;                      ///< Of the frame.
  const std::vector<int32_t>& in_view;  ///< Slots of blocks that may be in view, and others.
};

class Fusion {
 public:
  Fusion(const MapperParams& params, const Rules& rules, const Stream& stream);

  /// Makes room for a frame with so many blocks in view. @throws CudaError without memory; the map
  /// is untouched.
  void reserve(const FrameCounters& counters, size_t in_view);

  /// Casts all surfels into the frame's sums, and folds those into the voxels. Voxel projection
  /// does both at once.
  void castAndFold(const DeviceSensing& sensing, const DeviceSurfels& surfels,
                   const FusionTarget& target, const FrameCounters& counters);

  /// Enqueues the search for the blocks that the frame looks at without touching them.
  /// @pre reserve() made the room.
  void findLooks(const DeviceSensing& sensing, const FusionTarget& target, const LookTurn& turn);

  /// Takes evidence from what the frame contradicts, marks what has changed for the mesh, and lists
  /// arrays that hold nothing.
  void clear(const DeviceSensing& sensing, const FusionTarget& target,
             const FrameCounters& counters, uint64_t frame_number);

  /// Waits for the frame. @return its empty blocks, by slot; reported once.
  std::vector<EmptyBlock> takeEmptyBlocks();

  void addMemory(std::vector<MemoryPart>& parts) const;

 private:
  void reserveSums(uint32_t arrays);
  void cast(const DeviceSensing& sensing, const DeviceSurfels& surfels, const TouchedView& touched,
            const SumsView& part);
  void fold(const FrameView& frame, const FusionTarget& target, const SumsView& part);
  void project(const DeviceSensing& sensing, const DeviceSurfels& surfels,
               const FusionTarget& target, uint32_t blocks);

  const bool casts_;  ///< Else voxels are projected.
  const FusionSettings fusion_;
  const Stream& stream_;
  Event cleared_;
  const int thread_blocks_;  ///< That fill the device, for kernels whose work is counted there.
  bool is_cleared_ = false;  ///< A frame's empty blocks have not been taken yet.
  DeviceBuffer<VoxelSums> sums_;  ///< All zero between frames.
  DeviceBuffer<uint32_t> supported_;  ///< Bits of the voxels that the frame supports, by its sums.
  PinnedBuffer<int32_t> in_view_;  ///< Kernels read it in place,
  uint32_t in_view_count_ = 0;     ///< of the last frame; 0: it does not look around.
  DeviceBuffer<int32_t> looks_;
  PinnedBuffer<EmptyBlock> empty_blocks_;  ///< and write these there.
  PinnedBuffer<uint32_t> empty_count_{1};
};

}  // namespace gpu
}  // namespace dtsdf
