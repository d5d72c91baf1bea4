/// The stage "see free" on the device: which cells of space a depth image sees through.
#pragma once

#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "kernels/space/see_free.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// The search is enqueued, and its result fetched when the frame is done. The buffers are kept from
/// frame to frame.
class FreeCellFinder {
 public:
  FreeCellFinder(int32_t cell_log2, float max_range_m, const Stream& stream);

  /// Enqueues the search in those cubes, and its way to the host. What was not taken of the frame
  /// before is lost. @throws BackendError without memory.
  void find(const FrameView& frame, const float* free_depth, std::vector<Vec3i> cubes);

  /// Waits for it. @return the cubes of which something is seen free, in the order given.
  std::vector<CubeMask> take();

  void addMemory(MapperMemory& memory) const;

 private:
  void reserve(const FrameView& frame);
  FreePyramid makePyramid(const FrameView& frame, const float* free_depth);

  const int32_t cell_log2_;
  const float max_range_m_;
  const Stream& stream_;
  Event fetched_;
  std::vector<Vec3i> keys_;     ///< Keys of the frame's cubes.
  DeviceBuffer<float> levels_;  ///< The pyramid's levels from the second on, one after the other.
  DeviceBuffer<Vec3i> cubes_;
  DeviceBuffer<CellMask> masks_;
  PinnedBuffer<Vec3i> pinned_cubes_;
  PinnedBuffer<CellMask> pinned_masks_;
};

}  // namespace gpu
}  // namespace dtsdf
