/// The stage "align" on the device: what an image's points say of its pose.
#pragma once

#include "backend/pose_solver.h"
#include "device_map.h"
#include "dtsdf_mapping/mapper.h"
#include "kernels/poses/alignment_sums.h"
#include "runtime/buffer.h"
#include "sense.h"

namespace dtsdf {
namespace gpu {

/// The buffers are kept from image to image.
class PoseAligner {
 public:
  PoseAligner(const AlignmentSettings& settings, bool directional, const Stream& stream);

  /// Enqueues the making of an image's points. @pre The image is uploaded.
  void takePoints(const FrameView& view, const RawDepth& raw);

  /// The sums of these points at another pose of the same image; waits for them.
  AlignmentSums sumsAt(const FrameView& view, float cutoff, const MapView& map);

  /// Blocks that these sums look at, each once.
  std::vector<PackedKey> keysAt(const FrameView& view, float cutoff);

  void addMemory(MapperMemory& memory) const;

 private:
  const AlignmentSettings settings_;
  const bool directional_;
  const Stream& stream_;
  size_t point_count_ = 0;
  DeviceBuffer<AlignedPoint> points_;
  DeviceBuffer<AlignmentSums> sums_;  ///< That blocks of threads add up,
  DeviceBuffer<uint32_t> finished_;   ///< and how many have; all 0 between kernels.
  PinnedBuffer<AlignmentSums> pinned_sums_;
  PinnedBuffer<AlignedPoint> pinned_points_;  ///< A copy on the host, once it is asked for.
  bool has_pinned_points_ = false;
};

}  // namespace gpu
}  // namespace dtsdf
