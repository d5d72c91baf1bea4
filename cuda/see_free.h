/// The stage "see free" on the device: finds the cells that are free according to a depth image.
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

  /// Enqueues the search for free cells in cubes of 8 x 8 x 8 cells with these keys, and the
  /// download of the result. Discards a previous result that was not taken.
  /// @throws BackendError if memory runs out.
  void find(const FrameView& frame, const float* free_depth, std::vector<Vec3i> cubes);

  /// Waits for the result. @return the cubes with free cells, in the order of `cubes`.
  std::vector<CubeMask> take();

  void addMemory(MapperMemory& memory) const;

 private:
  void reserve(const FrameView& frame);
  FreePyramid makePyramid(const FrameView& frame, const float* free_depth);

  const int32_t cell_log2_;
  const float max_range_m_;
  const Stream& stream_;
  Event fetched_;
  std::vector<Vec3i> keys_;     ///< Keys of the cubes being searched.
  DeviceBuffer<float> levels_;  ///< The levels of the pyramid from level 1 on, concatenated.
  DeviceBuffer<Vec3i> cubes_;
  DeviceBuffer<CellMask> masks_;
  PinnedBuffer<Vec3i> pinned_cubes_;
  PinnedBuffer<CellMask> pinned_masks_;
};

}  // namespace gpu
}  // namespace dtsdf
