#include "fusion.h"

#include <algorithm>

#include "backend/rule_settings.h"
#include "device_map.cuh"
#include "find_blocks.cuh"
#include "kernels/fusion/cast.h"
#include "kernels/fusion/voxel_projection.h"
#include "kernels/fusion/voxel_update.h"
#include "launch.h"

namespace dtsdf {
namespace gpu {
namespace {

/// Maximum number of arrays of sums in memory, 12 KiB each. A frame that touches more arrays is
/// fused in several passes, so that a small GPU can fuse any frame.
constexpr uint32_t kMaxSumArrays = 16384;

static_assert(sizeof(VoxelSums) == 3 * sizeof(unsigned long long), "must be three 64-bit integers");

/// Adds a sample to the sums with integer atomics, so the result does not depend on the order.
__device__ void addAtomically(VoxelSums* sums, int32_t weight, int32_t sdf, uint32_t point_key) {
  VoxelSums sample{};
  addToSums(sample, weight, sdf, point_key);
  atomicAdd(reinterpret_cast<unsigned long long*>(&sums->weighted_sdf),
            static_cast<unsigned long long>(sample.weighted_sdf));
  atomicAdd(reinterpret_cast<unsigned long long*>(&sums->weight),
            static_cast<unsigned long long>(sample.weight));
  if (sample.nearest != 0) atomicMax(&sums->nearest, sample.nearest);
}

/// One thread per part of the line along which a surfel updates voxels. Four thread blocks share a
/// multiprocessor, to hide the latency of atomics. Does nothing if the table of touched blocks was
/// too small.
__global__ void __launch_bounds__(kThreads, 4)
    castSurfelsKernel(DeviceSensing on_device, FusionSettings fusion, DeviceSurfels surfels,
                      TouchedView touched, SumsView part) {
  waitForPreviousKernel();
  const LinePart part_of_line = linePartOf(surfels);
  if (part_of_line.surfel >= surfels.size() || touched.counters->table_full) return;
  const FrameSensing sensing = on_device.load();
  const Surfel& surfel = surfels.surfels[part_of_line.surfel];
  SampleLine line = sampleLineOf(surfel, sensing, fusion);
  const MeasuredSides sides = measuredSides(surfel, sensing.image.frame, line.axis);
  const DirectionSet directions = lineDirections(surfel, fusion.directional != 0);
  part_of_line.takeFrom(line);
  const Vec3i origin_block = blockOfVoxel(sensing.image.frame.origin_voxel);
  // The touched block of the last sample, its first array of sums and its directions. They are
  // looked up only when a sample lies in another block.
  constexpr uint32_t kBeyondAll = 1u << 31;
  PackedKey key = kNoKey;
  uint32_t first_sum = kBeyondAll, summed = 0;
  auto add = [&](const Vec3i& voxel_L, const CornerSample& sample, int32_t sdf) {
    const PackedKey sample_key = packKey(blockOfVoxel(voxel_L) + origin_block);
    if (sample_key != key) {
      key = sample_key;
      const int32_t place = findTouched(touched, key);
      first_sum = place < 0 ? kBeyondAll : touched.first_sums[place];
      summed = place < 0 ? 0 : touched.directions[place];
    }
    const int index = indexInBlock(voxel_L);
    for (int d = 0; d < 3; ++d) {
      if (d >= directions.count) break;
      const int32_t weight = roundWeight(sample.share * directions.weight[d]);
      const uint32_t before = summed & ((1u << directions.direction[d]) - 1u);
      const uint32_t sum = first_sum + __popc(before) - part.first;
      if (weight == 0 || sum >= part.count) continue;
      addAtomically(&part.sums[static_cast<size_t>(sum) * kVoxelsPerBlock + index], weight, sdf,
                    sample.point_key);
    }
  };
  castSurfel(line, sides, fusion, add);
}

/// Merges sums into voxels, then zeroes the sums. One thread block per array of sums.
__global__ void foldSumsKernel(FrameView frame, FusionSettings fusion, MapView map,
                               TouchedView touched, SumsView part, uint32_t* covered) {
  waitForPreviousKernel();
  const uint32_t owner = touched.sum_owners[part.first + blockIdx.x];
  TouchedBlock& block = touched.blocks[owner / 8];
  const int direction = owner % 8;
  const int32_t slot = slotOf(map, block);
  const int32_t array = slot < 0 ? kNoArray : map.slots[slot].array[direction];
  VoxelSums* sums = part.sums + static_cast<size_t>(blockIdx.x) * kVoxelsPerBlock;
  Voxel* voxels = array == kNoArray ? nullptr : map.voxels.record(array);
  const float depth_weight = blockDepthWeight(frame, block.block_L, fusion.rules);
  uint32_t* words = covered + static_cast<size_t>(part.first + blockIdx.x) * kCoverWords;
  int observed = 0;
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) {
    const VoxelSums own = sums[i];
    const bool is_covered = own.weight != 0;
    if (voxels != nullptr) {
      Voxel voxel = voxels[i];
      if (is_covered) voxels[i] = voxel = foldSums(voxel, own, depth_weight, fusion);
      observed |= !isEmpty(voxel);
    }
    const uint32_t word = __ballot_sync(~0u, is_covered);
    if (i % 32 == 0) words[i / 32] = word;
    if (is_covered) sums[i] = VoxelSums{};  // all others are 0 already
  }
  const bool empty = !__syncthreads_or(observed) && voxels != nullptr;
  if (threadIdx.x == 0 && empty) atomicOr(&block.empty, 1u << direction);
}

/// One thread block per touched block. A voxel uses a single pixel, so its sums are local to a
/// thread.
__global__ void projectVoxelsKernel(FrameView frame, FusionSettings fusion, const Surfel* surfels,
                                    MapView map, TouchedView touched) {
  __shared__ uint32_t observed;
  TouchedBlock& block = touched.blocks[blockIdx.x];
  const int32_t slot = slotOf(map, block);
  if (slot < 0) return;
  if (threadIdx.x == 0) observed = 0;
  __syncthreads();
  const SlotEntry entry = map.slots[slot];
  const float depth_weight = blockDepthWeight(frame, block.block_L, fusion.rules);
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) {
    VoxelSums sums[kDirectionCount] = {};
    auto add = [&](int direction, int32_t weight, int32_t sdf, uint32_t point_key) {
      addToSums(sums[direction], weight, sdf, point_key);
    };
    projectVoxel(frame, fusion, surfels, firstVoxelOfBlock(block.block_L) + voxelOffset(i), add);
    for (int d = 0; d < kDirectionCount; ++d) {
      if (entry.array[d] == kNoArray) continue;
      Voxel& voxel = map.voxels.record(entry.array[d])[i];
      voxel = foldSums(voxel, sums[d], depth_weight, fusion);
      if (!isEmpty(voxel)) atomicOr(&observed, 1u << d);
    }
  }
  __syncthreads();
  if (threadIdx.x == 0) block.empty = directionsOfSlot(entry) & ~observed;
}

}  // namespace

Fusion::Fusion(const MapperParams& params, const Rules& rules, const Stream& stream)
    : casts_(castsSurfels(params)), fusion_(makeFusionSettings(params, rules)), stream_(stream) {}

/// Reserves only an eighth more than needed, as sums take up most of a frame's memory.
void Fusion::reserveSums(uint32_t arrays) {
  if (static_cast<size_t>(arrays) * kVoxelsPerBlock <= sums_.capacity()) return;
  const size_t with_spare = std::min(arrays + arrays / 8, kMaxSumArrays);
  are_cast_ = true;  // stays true if an exception prevents zeroing
  sums_.reserveExactly(with_spare * kVoxelsPerBlock, stream_);
  sums_.zero(stream_);
  are_cast_ = false;
}

void Fusion::reserve(const FrameCounters& counters) {
  if (!casts_) return;
  reserveSums(std::min(counters.touched_arrays, kMaxSumArrays));
  covered_.reserve(static_cast<size_t>(counters.touched_arrays) * kCoverWords, stream_);
}

void Fusion::castAhead(const DeviceSensing& sensing, const DeviceSurfels& surfels,
                       const TouchedView& touched) {
  if (!casts_ || room() == 0) return;
  if (are_cast_) sums_.zero(stream_);
  are_cast_ = true;
  cast(sensing, surfels, touched, {sums_.data(), 0, room()});
}

void Fusion::castAndFold(const DeviceSensing& sensing, const DeviceSurfels& surfels,
                         const MapView& map, const TouchedView& touched,
                         const FrameCounters& counters) {
  if (!casts_) return project(sensing, surfels, map, touched, counters.touched);
  const DeviceSurfels all{surfels.surfels, counters.usable_surfels, nullptr};
  for (uint32_t first = 0; first < counters.touched_arrays; first += room()) {
    const SumsView part{sums_.data(), first, std::min(room(), counters.touched_arrays - first)};
    if (!are_cast_) cast(sensing, all, touched, part);
    are_cast_ = true;
    fold(sensing.frame(), map, touched, part);
    are_cast_ = false;
  }
  are_cast_ = false;  // also if no array was touched
}

void Fusion::cast(const DeviceSensing& sensing, const DeviceSurfels& surfels,
                  const TouchedView& touched, const SumsView& part) {
  launchOverlapped("castSurfelsKernel", castSurfelsKernel, blocksFor(surfels.room), kThreads, 0,
                   stream_, sensing, fusion_, surfels, touched, part);
}

void Fusion::fold(const FrameView& frame, const MapView& map, const TouchedView& touched,
                  const SumsView& part) {
  launchOverlapped("foldSumsKernel", foldSumsKernel, part.count, kThreads, 0, stream_, frame,
                   fusion_, map, touched, part, covered_.data());
}

void Fusion::project(const DeviceSensing& sensing, const DeviceSurfels& surfels, const MapView& map,
                     const TouchedView& touched, uint32_t blocks) {
  launch("projectVoxelsKernel", projectVoxelsKernel, blocks, kThreads, 0, stream_, sensing.frame(),
         fusion_, surfels.surfels, map, touched);
}

void Fusion::addMemory(MapperMemory& memory) const { addScratch(memory, sums_, covered_); }

}  // namespace gpu
}  // namespace dtsdf
