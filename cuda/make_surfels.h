/// The stage "make surfels" on the device: makes the surfels of a sensed frame.
#pragma once

#include "kernels/surfels/surfel.h"
#include "sense.h"

namespace dtsdf {
namespace gpu {

/// Surfels on the device.
struct DeviceSurfels {
  const Surfel* surfels;
  uint32_t room;          ///< Upper limit of their number.
  const uint32_t* count;  ///< Their number, also counting those without room; null: `room`.

#ifdef __CUDACC__
  __device__ __forceinline__ uint32_t size() const {
    return count == nullptr || *count > room ? room : *count;
  }
#endif
};

/// Makes the surfels of frames. Buffers are reused from frame to frame.
class SurfelMaker {
 public:
  SurfelMaker(const MapperParams& params, const SurfelRules& rules, const Stream& stream);

  /// Enqueues the stage. For casting, it makes a surfel per square of merged pixels, per pixel, or
  /// per subpixel, in a list without gaps; a few of them have no weight. If `count` (on the device,
  /// 0 before) exceeds their room, the rest are missing. For voxel projection, it makes one per
  /// pixel, in the image's order, and `count` gets the number of those with a weight.
  DeviceSurfels makeSurfels(const DeviceSensing& sensing, uint32_t* count);

  /// Makes the surfels of the same frame again, with more room.
  DeviceSurfels remakeSurfels(const DeviceSensing& sensing, uint32_t surfels, uint32_t* count);

  void addMemory(MapperMemory& memory) const;

 private:
  void mergePixels(const DeviceSensing& sensing);
  DeviceSurfels listSurfels(const DeviceSensing& sensing, uint32_t* count);

  const bool merges_;  ///< Whether pixels are merged and subdivided: only for casting.
  const SurfelSettings surfel_settings_;
  const Stream& stream_;
  DeviceBuffer<uint8_t> patches_;  ///< MergedPatch per patch.
  DeviceBuffer<Surfel> surfels_;
};

}  // namespace gpu
}  // namespace dtsdf
