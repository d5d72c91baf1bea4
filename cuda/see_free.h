/// The stage "see free" on the device: finds the cells of space that a depth image sees through.
#pragma once

#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "kernels/space/see_free.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

class FreeCellFinder {
 public:
  FreeCellFinder(int32_t cell_log2, float max_range_m, const Stream& stream);

  /// Enqueues the search in `cubes`, and the download of the result. A result of the previous frame
  /// that was not taken is lost. @throws BackendError if memory runs out.
  void find(const FrameView& frame, const float* free_depth, std::vector<Vec3i> cubes);

  /// Waits for the result. @return the cubes with cells that the image saw through, in the given
  /// order.
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
  DeviceBuffer<float> levels_;  ///< The pyramid's levels, from level 1, one after the other.
  DeviceBuffer<Vec3i> cubes_;
  DeviceBuffer<CellMask> masks_;
  PinnedBuffer<Vec3i> pinned_cubes_;
  PinnedBuffer<CellMask> pinned_masks_;
};

}  // namespace gpu
}  // namespace dtsdf
