/// Depth image to surfels on the device.
#pragma once

#include "dtsdf_mapping/kernels/surfel.h"
#include "dtsdf_mapping/mapper/mapper_params.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// A depth image with its rows packed, as it lies in pinned memory.
struct RawDepth {
  DepthEncoding encoding;
  float unit_m;
};

/// One surfel per pixel; the buffers are kept from frame to frame.
class FrameSurfels {
 public:
  /// Pinned memory for the raw image of the next frame. The last upload must be done.
  void* stage(size_t bytes);

  /// Enqueues the upload of what was staged and the computation; `usable` (on the device) stays 0
  /// if no surfel has a weight.
  void compute(const RawDepth& raw, const FrameView& view, const MapperParams& params,
               uint32_t* usable, const Stream& stream);

  const Surfel* surfels() const { return surfels_.data(); }

 private:
  PinnedBuffer<unsigned char> pinned_raw_;
  DeviceBuffer<unsigned char> raw_;
  size_t raw_bytes_ = 0;
  DeviceBuffer<float> inverse_depth_, row_value_, row_slope_;
  DeviceBuffer<Surfel> surfels_;
};

}  // namespace gpu
}  // namespace dtsdf
