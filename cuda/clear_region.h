/// Emptying voxels by where they are, on the device.
#pragma once

#include <vector>

#include "device_map.h"
#include "kernels/core/region.h"
#include "map/block_table.h"

namespace dtsdf {
namespace gpu {

class RegionClearer {
 public:
  explicit RegionClearer(const Stream& stream) : stream_(stream) {}

  /// Empties the blocks' voxels in a region in units of voxels, with their colours, and waits.
  /// @return what became of each. @throws CudaError without memory; the map is untouched then.
  std::vector<EmptiedBlock> clear(const std::vector<int32_t>& slots, const RegionView& region,
                                  const MapView& map);

  void addMemory(std::vector<MemoryPart>& parts) const;

 private:
  const Stream& stream_;
  PinnedBuffer<int32_t> slots_;         ///< The kernel reads them in place,
  PinnedBuffer<EmptiedBlock> emptied_;  ///< and writes these there.
};

}  // namespace gpu
}  // namespace dtsdf
