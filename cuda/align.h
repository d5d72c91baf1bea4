/// The stage "align" on the device: selects points in an image, and accumulates their normal
/// equations.
#pragma once

#include "backend/pose_solver.h"
#include "device_map.h"
#include "dtsdf_mapping/mapper.h"
#include "kernels/poses/alignment_sums.h"
#include "runtime/buffer.h"
#include "sense.h"

namespace dtsdf {
namespace gpu {

class PoseAligner {
 public:
  PoseAligner(const AlignmentSettings& settings, bool directional, const Stream& stream);

  /// Enqueues the kernel that selects an image's points. @pre The upload of the image is enqueued.
  void takePoints(const FrameView& view, const RawDepth& raw);

  /// Accumulates the sums over the points that takePoints() selected, and waits for the result.
  /// @param view Camera of the image, at the pose to evaluate.
  AlignmentSums sumsAt(const FrameView& view, float cutoff, const MapView& map);

  /// Keys of the blocks that sumsAt() may read, without duplicates.
  std::vector<PackedKey> keysAt(const FrameView& view, float cutoff);

  void addMemory(MapperMemory& memory) const;

 private:
  const AlignmentSettings settings_;
  const bool directional_;
  const Stream& stream_;
  size_t point_count_ = 0;
  DeviceBuffer<AlignedPoint> points_;
  DeviceBuffer<AlignmentSums> sums_;  ///< Accumulated by a kernel; 0 between kernels.
  DeviceBuffer<uint32_t> finished_;   ///< Number of finished thread blocks; 0 between kernels.
  PinnedBuffer<AlignmentSums> pinned_sums_;
  PinnedBuffer<AlignedPoint> pinned_points_;  ///< Copied to the host only when needed.
  bool has_pinned_points_ = false;
};

}  // namespace gpu
}  // namespace dtsdf
