/// The stage "align" on the device: picks points of an image, and sums their normal equations.
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

  /// Enqueues the kernel that picks an image's points. @pre The image is uploaded.
  void takePoints(const FrameView& view, const RawDepth& raw);

  /// The sums over the points of takePoints(); waits for the result. @param view The image's
  /// camera, at any pose.
  AlignmentSums sumsAt(const FrameView& view, float cutoff, const MapView& map);

  /// Keys of the blocks that sumsAt() may read, each once.
  std::vector<PackedKey> keysAt(const FrameView& view, float cutoff);

  void addMemory(MapperMemory& memory) const;

 private:
  const AlignmentSettings settings_;
  const bool directional_;
  const Stream& stream_;
  size_t point_count_ = 0;
  DeviceBuffer<AlignedPoint> points_;
  DeviceBuffer<AlignmentSums> sums_;  ///< Totals of a kernel; 0 between kernels.
  DeviceBuffer<uint32_t> finished_;   ///< Thread blocks that are done; 0 between kernels.
  PinnedBuffer<AlignmentSums> pinned_sums_;
  PinnedBuffer<AlignedPoint> pinned_points_;  ///< A copy on the host, made when needed.
  bool has_pinned_points_ = false;
};

}  // namespace gpu
}  // namespace dtsdf
