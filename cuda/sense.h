/// The stage "sense" on the device: all that is known of a frame before its surfels are made.
#pragma once

#include "backend/rules.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "kernels/fusion/fusion_rules.h"
#include "kernels/surfels/depth.h"
#include "kernels/surfels/noise.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// FrameSensing before kernels have loaded it: the noise is known on the device alone.
class DeviceSensing {
 public:
  DeviceSensing(const ImageView& image, const DepthNoise* noise, const float* free_depth)
      : image_(image), noise_(noise), free_depth_(free_depth) {}

  DTSDF_HD const ImageView& image() const { return image_; }
  DTSDF_HD const FrameView& frame() const { return image_.frame; }
  /// Only a frame that clears has free depths: another one has none, even if space asks for it.
  DTSDF_HD bool hasFreeDepth() const { return free_depth_ != nullptr; }
#ifdef __CUDACC__
  __device__ __forceinline__ FrameSensing load() const { return {image_, *noise_, free_depth_}; }
#endif

 private:
  ImageView image_;
  const DepthNoise* noise_;
  const float* free_depth_;
};

/// A raw depth image on the device, with its rows packed.
struct RawDepth {
  const void* data;
  int32_t width, height;
  bool is_uint16;  ///< Else float.
  DepthRange range;
};

#ifdef __CUDACC__
/// The inverse depth of a pixel.
__device__ __forceinline__ float inverseDepthAt(const RawDepth& raw, int u, int v) {
  const int64_t i = static_cast<int64_t>(v) * raw.width + u;
  const float value = raw.is_uint16 ? static_cast<float>(static_cast<const uint16_t*>(raw.data)[i])
                                    : static_cast<const float*>(raw.data)[i];
  return inverseDepth(value, raw.range);
}
#endif

/// Lines of a frame by kinds and bins of their variance; all 0 between frames.
struct NoiseCounts {
  alignas(16) uint32_t bins[kNoiseKinds][kNoiseBins];
  uint32_t finished;  ///< Blocks of threads that have counted theirs.
};

/// The buffers are kept from frame to frame.
class FrameSensor {
 public:
  FrameSensor(const MapperParams& params, const Rules& rules, const Stream& stream);

  /// Enqueues the stage for an image that is uploaded, but for its free depths.
  DeviceSensing sense(const FrameView& frame, const RawDepth& raw);

  /// Enqueues what the stage leaves for later, where something asks for it: beside the kernel
  /// ahead, which has waited for what it works on.
  void findFreeDepths(const DeviceSensing& sensing);

  /// How far each pixel of the last frame is free, whether or not the frame clears by it.
  /// @pre needsFreeDepth().
  const float* freeDepth() const { return free_depth_.data(); }

  void addMemory(MapperMemory& memory) const;

 private:
  void reserve(size_t pixels);

  const bool clears_;      ///< What frames see through is taken from the map.
  const bool finds_free_;  ///< It is asked how far pixels are free, for that or for space.
  const SurfelSettings surfel_settings_;
  const FusionSettings fusion_settings_;
  const Stream& stream_;
  DeviceBuffer<float> measured_, inverse_depth_, row_value_, row_slope_, free_depth_;
  DeviceBuffer<PixelLinks> links_;
  DeviceBuffer<DepthNoise> noise_;
  DeviceBuffer<NoiseCounts> noise_counts_;
};

}  // namespace gpu
}  // namespace dtsdf
