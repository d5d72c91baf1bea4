/// The stages "cast" and "fold" on the device: add a frame's surfels to sums per voxel, then merge
/// these sums into the map's voxels.
#pragma once

#include "backend/rules.h"
#include "find_blocks.h"

namespace dtsdf {
namespace gpu {

/// The sums for `count` of the frame's arrays, starting at index `first`.
struct SumsView {
  VoxelSums* sums;
  uint32_t first, count;
};

/// Number of 32-bit words needed for one bit per voxel of an array.
constexpr int kCoverWords = kVoxelsPerBlock / 32;

class Fusion {
 public:
  Fusion(const MapperParams& params, const Rules& rules, const Stream& stream);

  /// Reserves memory for a frame. @throws BackendError if memory runs out; the map is not changed.
  void reserve(const FrameCounters& counters);

  /// Enqueues the cast of the surfels into all arrays of sums that fit in memory, since the host
  /// does not know yet how many are needed. Casting does not read the map, so the host can admit
  /// blocks in the meantime. If the frame is refused or repeated, the next cast discards its sums.
  void castAhead(const DeviceSensing& sensing, const DeviceSurfels& surfels,
                 const TouchedView& touched);

  /// Enqueues the cast into the remaining sums, and the fold of all sums into voxels. With voxel
  /// projection, a single kernel does both.
  void castAndFold(const DeviceSensing& sensing, const DeviceSurfels& surfels, const MapView& map,
                   const TouchedView& touched, const FrameCounters& counters);

  /// The voxels that the last frame covers, one bit each: kCoverWords words per array of sums.
  const uint32_t* covered() const { return covered_.data(); }

  void addMemory(MapperMemory& memory) const;

 private:
  uint32_t room() const { return static_cast<uint32_t>(sums_.capacity() / kVoxelsPerBlock); }
  void reserveSums(uint32_t arrays);
  void cast(const DeviceSensing& sensing, const DeviceSurfels& surfels, const TouchedView& touched,
            const SumsView& part);
  void fold(const FrameView& frame, const MapView& map, const TouchedView& touched,
            const SumsView& part);
  void project(const DeviceSensing& sensing, const DeviceSurfels& surfels, const MapView& map,
               const TouchedView& touched, uint32_t blocks);

  const bool casts_;  ///< False with voxel projection.
  const FusionSettings fusion_;
  const Stream& stream_;
  DeviceBuffer<VoxelSums> sums_;  ///< All zero between frames, unless are_cast_.
  bool are_cast_ = false;         ///< Whether sums were cast but not folded.
  DeviceBuffer<uint32_t> covered_;
};

}  // namespace gpu
}  // namespace dtsdf
