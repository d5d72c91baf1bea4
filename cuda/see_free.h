/// The stage "see free" on the device: which cells of space a depth image sees through.
#pragma once

#include <vector>

#include "backend/profile.h"
#include "kernels/space/see_free.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// What a frame sees through is enqueued, and fetched when the frame is done: whoever wants it
/// takes it then. The buffers are kept from frame to frame.
class FreeSeer {
 public:
  FreeSeer(const CellGrid& grid, float max_range_m, const Stream& stream);

  /// Enqueues the search in those cubes, and its way to the host. What was not taken of the frame
  /// before is lost. @throws CudaError without memory.
  void see(const FrameView& frame, const float* free_depth, std::vector<Vec3i> cubes);

  /// The frame is part of the map: take() gives what it saw.
  void keep() { is_kept_ = true; }
  bool isKept() const { return is_kept_; }

  /// Waits for the frame that was kept. @return the cubes of which something is seen free, in the
  /// order that they were asked for. Tells them once.
  std::vector<FreeCube> take();

  void addMemory(std::vector<MemoryPart>& parts) const;

 private:
  void reserve(const FrameView& frame);
  FreePyramid makePyramid(const FrameView& frame, const float* free_depth);

  const CellGrid grid_;
  const float max_range_m_;
  const Stream& stream_;
  Event fetched_;
  bool is_kept_ = false;
  std::vector<Vec3i> keys_;  ///< Of the frame's cubes.
  DeviceBuffer<float> levels_;  ///< Of the pyramid, from the second one on, one after the other.
  DeviceBuffer<Vec3i> cubes_;
  DeviceBuffer<CellMask> masks_;
  PinnedBuffer<Vec3i> pinned_cubes_;
  PinnedBuffer<CellMask> pinned_masks_;
};

}  // namespace gpu
}  // namespace dtsdf
