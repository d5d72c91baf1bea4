/// The stage "make surfels" on the device: makes the surfels of a sensed frame.
#pragma once

#include "kernels/surfels/surfel.h"
#include "sense.h"

namespace dtsdf {
namespace gpu {

struct DeviceSurfels {
  const Surfel* surfels;
  uint32_t room;          ///< Capacity of the list; surfels beyond it are missing.
  const uint32_t* count;  ///< Number made, including those beyond `room`; null: `room`.

#ifdef __CUDACC__
  __device__ __forceinline__ uint32_t size() const {
    return count == nullptr || *count > room ? room : *count;
  }
#endif
};

class SurfelMaker {
 public:
  SurfelMaker(const MapperParams& params, const SurfelRules& rules, const Stream& stream);

  /// Enqueues the stage. For casting, it lists a surfel for each merged square with a weight, and
  /// one for each unmerged pixel with a plane, or for each of its subpixels; a few of these have no
  /// weight. If `count` exceeds `room`, the rest are missing. For voxel projection, it makes one
  /// per pixel, in row-major order, and counts those with a weight.
  /// @param count Counter on the device, with the value 0.
  DeviceSurfels makeSurfels(const DeviceSensing& sensing, uint32_t* count);

  /// Repeats the stage for the same frame with room for `surfels` surfels.
  DeviceSurfels remakeSurfels(const DeviceSensing& sensing, uint32_t surfels, uint32_t* count);

  void addMemory(MapperMemory& memory) const;

 private:
  void mergePixels(const DeviceSensing& sensing);
  DeviceSurfels listSurfels(const DeviceSensing& sensing, uint32_t* count);

  const bool merges_;  ///< Whether pixels are merged and subdivided: only for casting.
  const SurfelSettings surfel_settings_;
  const Stream& stream_;
  DeviceBuffer<uint8_t> patches_;  ///< A MergedPatch per patch.
  DeviceBuffer<Surfel> surfels_;
};

}  // namespace gpu
}  // namespace dtsdf
