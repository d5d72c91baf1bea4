#include "clear_region.h"

#include <algorithm>

#include "device_map.cuh"
#include "launch.h"

namespace dtsdf {
namespace gpu {
namespace {

/// One block of threads per block of the map.
__global__ void emptyRegionKernel(MapView map, RegionView region, const int32_t* slots,
                                  EmptiedBlock* emptied) {
  __shared__ uint32_t voxels_emptied;
  if (threadIdx.x == 0) voxels_emptied = 0;
  __syncthreads();
  const SlotEntry& entry = map.slots[slots[blockIdx.x]];
  const Vec3i first = firstVoxelOfBlock(unpackKey(entry.key));
  uint32_t empty_directions = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    Voxel* voxels = map.voxels.record(entry.array[d]);
    int holds = 0, count = 0;
    for (int i = threadIdx.x; i < kVoxelsPerBlock; i += kThreads) {
      const bool is_empty = isEmpty(voxels[i]);
      if (!isInside(region, first + voxelOffset(i))) {
        holds |= !is_empty;
        continue;
      }
      voxels[i] = Voxel{};
      if (is_empty) continue;
      forgetColour(map, entry.array[d], i);
      ++count;
    }
    if (count > 0) atomicAdd(&voxels_emptied, static_cast<uint32_t>(count));
    const bool changed = __syncthreads_or(count);
    const bool empty = !__syncthreads_or(holds);
    if (changed && empty) empty_directions |= 1u << d;
  }
  __syncthreads();
  if (threadIdx.x == 0) emptied[blockIdx.x] = {voxels_emptied, empty_directions};
}

}  // namespace

std::vector<EmptiedBlock> RegionClearer::clear(const std::vector<int32_t>& slots,
                                               const RegionView& region, const MapView& map) {
  if (slots.empty()) return {};
  slots_.reserve(slots.size());
  emptied_.reserve(slots.size());
  std::copy(slots.begin(), slots.end(), slots_.data());
  launch("emptyRegionKernel", emptyRegionKernel, static_cast<unsigned>(slots.size()), kThreads, 0,
         stream_, map, region, slots_.data(), emptied_.data());
  stream_.synchronize();
  return {emptied_.data(), emptied_.data() + slots.size()};
}

void RegionClearer::addMemory(std::vector<MemoryPart>& parts) const {
  addScratch("cleared region", parts, slots_, emptied_);
}

}  // namespace gpu
}  // namespace dtsdf
