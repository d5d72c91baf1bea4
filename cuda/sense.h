/// The stage "sense" on the device: prepares a depth image for making surfels.
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

/// Results of the stage. Kernels load() them as a FrameSensing, as the noise is in device memory.
class DeviceSensing {
 public:
  DeviceSensing(const ImageView& image, const DepthNoise* noise, const float* free_depth)
      : image_(image), noise_(noise), free_depth_(free_depth) {}

  DTSDF_HD const ImageView& image() const { return image_; }
  DTSDF_HD const FrameView& frame() const { return image_.frame; }
  /// Whether the frame clears voxels. False if only the free-space grid needs free depths, that is,
  /// the depths up to which pixels' rays are free.
  DTSDF_HD bool hasFreeDepth() const { return free_depth_ != nullptr; }
#ifdef __CUDACC__
  __device__ __forceinline__ FrameSensing load() const { return {image_, *noise_, free_depth_}; }
#endif

 private:
  ImageView image_;
  const DepthNoise* noise_;
  const float* free_depth_;
};

/// A raw depth image on the device, with packed rows.
struct RawDepth {
  const void* data;
  int32_t width, height;
  bool is_uint16;  ///< False if depths are float.
  DepthRange range;
};

#ifdef __CUDACC__
__device__ __forceinline__ float inverseDepthAt(const RawDepth& raw, int u, int v) {
  const int64_t i = static_cast<int64_t>(v) * raw.width + u;
  const float value = raw.is_uint16 ? static_cast<float>(static_cast<const uint16_t*>(raw.data)[i])
                                    : static_cast<const float*>(raw.data)[i];
  return inverseDepth(value, raw.range);
}
#endif

/// Number of pixel lines for estimating noise, per kind of line and bin of variances; all 0 between
/// frames.
struct NoiseCounts {
  alignas(16) uint32_t bins[kNoiseKinds][kNoiseBins];
  uint32_t finished;  ///< Thread blocks that have counted their lines.
};

class FrameSensor {
 public:
  FrameSensor(const MapperParams& params, const Rules& rules, const Stream& stream);

  /// Enqueues the stage, without free depths. @pre The upload of the image is enqueued.
  DeviceSensing sense(const FrameView& frame, const RawDepth& raw);

  /// Enqueues the search for free depths, if anything needs them. It may overlap the previous
  /// kernel, which must call waitForPreviousKernel().
  void findFreeDepths(const DeviceSensing& sensing);

  /// Free depths of the last frame's pixels, in device memory, even if the frame clears no voxels.
  /// @pre needsFreeDepth() is true.
  const float* freeDepth() const { return free_depth_.data(); }

  void addMemory(MapperMemory& memory) const;

 private:
  void reserve(size_t pixels);

  const bool clears_;      ///< Whether frames clear voxels.
  const bool finds_free_;  ///< Whether clearing or the free-space grid needs free depths.
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
