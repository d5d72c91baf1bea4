/// The stage "make surfels" on the device: makes surfels (measured points with normals) from the
/// output of the stage "sense".
#pragma once

#include "kernels/surfels/surfel.h"
#include "sense.h"

namespace dtsdf {
namespace gpu {

struct DeviceSurfels {
  const Surfel* surfels;
  uint32_t room;          ///< Capacity of the list; further surfels are dropped.
  const uint32_t* count;  ///< Number of surfels, including dropped ones; null if equal to `room`.

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
  /// for each subpixel of an unmerged pixel with a plane (an undivided pixel has one subpixel).
  /// Surfels beyond `room` are counted but dropped. For voxel projection, it makes one surfel per
  /// pixel, in row-major order, and counts those with a weight.
  /// @param count Counter on the device; must be 0 when the stage starts.
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
  DeviceBuffer<uint8_t> patches_;  ///< One MergedPatch for each patch of pixels.
  DeviceBuffer<Surfel> surfels_;
};

}  // namespace gpu
}  // namespace dtsdf
