/// The stage "make surfels" on the device: from what is known of a frame to its surfels.
#pragma once

#include "kernels/surfels/surfel.h"
#include "sense.h"

namespace dtsdf {
namespace gpu {

/// Surfels on the device.
struct DeviceSurfels {
  const Surfel* surfels;
  uint32_t room;          ///< There are so many at most.
  const uint32_t* count;  ///< How many there are, or would be with room for all; null: `room`.

#ifdef __CUDACC__
  __device__ __forceinline__ uint32_t size() const {
    return count == nullptr || *count > room ? room : *count;
  }
#endif
};

/// The buffers are kept from frame to frame.
class SurfelMaker {
 public:
  SurfelMaker(const MapperParams& params, const SurfelRules& rules, const Stream& stream);

  /// Enqueues the stage. To be cast: a surfel per square of merged pixels, per pixel, or per
  /// subpixel, without gaps, a few of them without a weight; if `count` (on the device, 0 before)
  /// comes out above their room, those beyond are missing. For voxel projection: one per pixel in
  /// the image's order, and `count` takes the number of those with a weight.
  DeviceSurfels makeSurfels(const DeviceSensing& sensing, uint32_t* count);

  /// Makes the surfels of the same frame once more, with room for more.
  DeviceSurfels makeMoreSurfels(const DeviceSensing& sensing, uint32_t surfels, uint32_t* count);

  void addMemory(MapperMemory& memory) const;

 private:
  void mergePixels(const DeviceSensing& sensing);
  DeviceSurfels listSurfels(const DeviceSensing& sensing, uint32_t* count);

  const bool merges_;  ///< Merges and subdivides pixels, as surfels are cast.
  const SurfelSettings surfel_settings_;
  const Stream& stream_;
  DeviceBuffer<uint8_t> patches_;  ///< MergedPatch per patch.
  DeviceBuffer<Surfel> surfels_;
};

}  // namespace gpu
}  // namespace dtsdf
