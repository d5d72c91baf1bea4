/// The stage "make surfels" on the device: makes surfels from the output of the stage "sense".
#pragma once

#include "kernels/surfels/surfel.h"
#include "sense.h"

namespace dtsdf {
namespace gpu {

struct DeviceSurfels {
  const Surfel* surfels;
  uint32_t room;          ///< Capacity of the list; surfels beyond it are missing.
  const uint32_t* count;  ///< Number made, including those beyond `room`; null if it equals `room`.

#ifdef __CUDACC__
  __device__ __forceinline__ uint32_t size() const {
    return count == nullptr || *count > room ? room : *count;
  }
#endif
};

class SurfelMaker {
 public:
  SurfelMaker(const MapperParams& params, const SurfelRules& rules, const Stream& stream);

  /// Enqueues the stage. For casting, it makes a surfel for each merged square with a weight, and
  /// for each unmerged pixel with a plane, or each of its subpixels; a few of the latter have no
  /// weight. If `count` exceeds `room`, the rest are missing. For voxel projection, it makes one
  /// surfel per pixel, in row-major order, and counts those with a weight.
  /// @param count Counter on the device; must be 0 at the start.
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
