/// Depth image to surfels, and to how far it saw free space, on the device.
#pragma once

#include "backend/profile.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "kernels/fusion/free_space.h"
#include "kernels/surfels/depth_noise.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// A depth image with its rows packed, as it lies in pinned memory.
struct RawDepth {
  DepthEncoding encoding;
  float unit_m;
};

/// Lines of a frame by bins of their variance; all 0 between frames.
struct NoiseCounts {
  uint32_t bins[kNoiseBins];
  uint32_t finished;  ///< Blocks of threads that have counted theirs.
};

/// The surfels of a frame; the buffers are kept from frame to frame.
class FrameSurfels {
 public:
  explicit FrameSurfels(const Stream& stream);

  /// Enqueues the upload of a frame's raw image, whose data is not needed any more on return. The
  /// last upload must be done.
  void upload(const DepthFrame& frame, const Stream& stream);

  /// Enqueues the computation of one surfel per pixel of what was uploaded, in the image's order.
  /// `count` (on the device, 0 before) takes the number of those with a weight.
  void computePixels(const RawDepth& raw, const FrameView& view, const MapperParams& params,
                     uint32_t* count, const Stream& stream);

  /// The same for one surfel per group, pixel, or part of a pixel, without gaps; a few may have no
  /// weight. If `count` comes out above room(), those beyond are missing.
  void computeGroups(const RawDepth& raw, const FrameView& view, const MapperParams& params,
                     uint32_t* count, const Stream& stream);

  /// Makes room for more surfels of the same frame, and enqueues their computation once more.
  void makeRoom(uint32_t surfels, const FrameView& view, const MapperParams& params,
                uint32_t* count, const Stream& stream);

  const Surfel* surfels() const { return surfels_.data(); }
  /// freeDepth() per pixel, on the device; after computeGroups().
  const float* freeDepth() const { return free_depth_.data(); }
  uint32_t room() const { return static_cast<uint32_t>(surfels_.capacity()); }
  size_t rawBytes() const { return raw_bytes_; }
  void addMemory(std::vector<MemoryPart>& parts) const;

  /// Standard deviation of the frame's inverse depth in 1/m, on the device.
  const float* noise() const { return noise_.data(); }

 private:
  void fitRows(const RawDepth& raw, const FrameView& view, const MapperParams& params,
               const Stream& stream);
  void listSurfels(const FrameView& view, const MapperParams& params, uint32_t* count,
                   const Stream& stream);
  FitImages images() const {
    return {inverse_depth_.data(), row_value_.data(), row_slope_.data()};
  }

  void copyRows(const DepthFrame& frame, int begin, int end);

  PinnedBuffer<unsigned char> pinned_raw_;
  DeviceBuffer<unsigned char> raw_;
  size_t raw_bytes_ = 0;
  DeviceBuffer<float> inverse_depth_, row_value_, row_slope_, free_depth_;
  DeviceBuffer<float> noise_;
  DeviceBuffer<NoiseCounts> noise_counts_;
  DeviceBuffer<uint8_t> groups_;  ///< TileGroups per tile.
  DeviceBuffer<Surfel> surfels_;
};

}  // namespace gpu
}  // namespace dtsdf
