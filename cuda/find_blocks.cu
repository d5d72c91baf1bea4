#include <algorithm>

#include "device_map.cuh"
#include "find_blocks.cuh"
#include "kernels/fusion/cast.h"
#include "launch.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr size_t kFirstCapacity = 8192;
/// Maximum number of probes per search. If a search needs more, the table is too small.
constexpr int kMaxProbes = 1024;

/// One thread per entry of the hash table.
__global__ void emptyTableKernel(TouchedView touched, bool counts_surfels) {
  const size_t i = globalThread();
  if (i == 0) {
    const uint32_t surfels = counts_surfels ? 0 : touched.counters->usable_surfels;
    *touched.counters = {};
    touched.counters->usable_surfels = surfels;
  }
  if (i > touched.mask) return;
  touched.keys[i] = kNoKey;
  touched.directions[i] = 0;
}

__device__ void touchBlock(const TouchedView& touched, PackedKey key, uint32_t directions) {
  uint32_t at = static_cast<uint32_t>(hashKey(key)) & touched.mask;
  for (int probe = 0; probe < kMaxProbes; ++probe, at = (at + 1) & touched.mask) {
    PackedKey found = readShared(&touched.keys[at]);
    if (found == kNoKey) {
      found = atomicCAS(reinterpret_cast<unsigned long long*>(&touched.keys[at]), kNoKey, key);
      if (found == kNoKey) {
        const uint32_t n = atomicAdd(&touched.counters->touched, 1u);
        if (n < touched.capacity) touched.places[n] = at;
        if (n >= touched.capacity) touched.counters->table_full = 1;
        found = key;
      }
    }
    if (found == key) {
      // Usually the directions are already set, and reading is far cheaper than an atomic.
      if (directions & ~readShared(&touched.directions[at])) {
        atomicOr(&touched.directions[at], directions);
      }
      return;
    }
  }
  touched.counters->table_full = 1;
}

/// One thread per part of the line along which a surfel updates voxels.
__global__ void __launch_bounds__(kThreads, 8)
    markBlocksKernel(DeviceSensing on_device, FusionSettings fusion, DeviceSurfels surfels,
                     TouchedView touched) {
  waitForPreviousKernel();
  const LinePart part = linePartOf(surfels);
  if (part.surfel >= surfels.size()) return;
  const Surfel surfel = surfels.surfels[part.surfel];
  if (!(surfel.weight > 0.0f) || readShared(&touched.counters->table_full)) return;
  const FrameSensing sensing = on_device.load();
  const uint32_t directions = directionMask(directionsOf(surfel.normal_L, fusion.directional != 0));
  const Vec3i origin_block = blockOfVoxel(sensing.image.frame.origin_voxel);
  SampleLine line = sampleLineOf(surfel, sensing, fusion);
  part.takeFrom(line);
  visitBlocks(line, [&](const Vec3i& block_L) {
    touchBlock(touched, packKey(block_L + origin_block), directions);
  });
}

/// Assigns to a block one array of sums per direction, in ascending order of directions.
__device__ void reserveSums(const TouchedView& touched, uint32_t block, uint32_t place,
                            uint32_t directions) {
  uint32_t sum =
      atomicAdd(&touched.counters->touched_arrays, static_cast<uint32_t>(__popc(directions)));
  touched.first_sums[place] = sum;
  for (uint32_t d = 0; d < kDirectionCount; ++d) {
    if (directions >> d & 1) touched.sum_owners[sum++] = 8 * block + d;
  }
}

/// One thread per touched block. The grid is sized for the table's capacity, since the host does
/// not know yet how many blocks are touched.
__device__ void compareWithMap(const Vec3i& origin_block, const MapView& map,
                               const TouchedView& touched, BlockRequest* requests) {
  if (touched.counters->table_full) return;
  const uint32_t count = touched.counters->touched;
  for (size_t i = globalThread(); i < count; i += static_cast<size_t>(gridDim.x) * blockDim.x) {
    const uint32_t place = touched.places[i];
    const PackedKey key = touched.keys[place];
    const uint32_t directions = touched.directions[place];
    const int32_t slot = findSlot(map, key);
    touched.blocks[i] = {key, unpackKey(key) - origin_block, directions, slot, 0};
    reserveSums(touched, static_cast<uint32_t>(i), place, directions);
    const uint32_t existing = slot < 0 ? 0 : directionsOfSlot(map.slots[slot]);
    const uint32_t missing = directions & ~existing;
    if (missing == 0) continue;
    requests[atomicAdd(&touched.counters->requests, 1u)] = {key, directions};
    atomicAdd(&touched.counters->requested_arrays, static_cast<uint32_t>(__popc(missing)));
  }
}

/// Writes requests to host memory. The last thread block to finish also writes the counters.
__global__ void compareWithMapKernel(Vec3i origin_block, MapView map, TouchedView touched,
                                     FrameCounters* host_counters, BlockRequest* requests) {
  waitForPreviousKernel();
  compareWithMap(origin_block, map, touched, requests);
  if (!isLastBlock(&touched.counters->compared, gridDim.x)) return;
  constexpr unsigned kWords = sizeof(FrameCounters) / sizeof(uint32_t);
  if (threadIdx.x >= kWords) return;
  reinterpret_cast<uint32_t*>(host_counters)[threadIdx.x] =
      readShared(reinterpret_cast<const uint32_t*>(touched.counters) + threadIdx.x);
}

/// One thread per touched block.
__global__ void readTouchedKernel(TouchedView touched, uint32_t count, PackedKey* keys) {
  const size_t i = globalThread();
  if (i < count) keys[i] = touched.blocks[i].key;
}

}  // namespace

BlockFinder::BlockFinder(const FusionSettings& fusion, const Stream& stream)
    : fusion_(fusion), stream_(stream), counters_(1), pinned_counters_(1) {
  allocate(kFirstCapacity);
}

void BlockFinder::allocate(size_t capacity) {
  keys_ = DeviceBuffer<PackedKey>(2 * capacity);
  directions_ = DeviceBuffer<uint32_t>(2 * capacity);
  first_sums_ = DeviceBuffer<uint32_t>(2 * capacity);
  places_ = DeviceBuffer<uint32_t>(capacity);
  blocks_ = DeviceBuffer<TouchedBlock>(capacity);
  sum_owners_ = DeviceBuffer<uint32_t>(kDirectionCount * capacity);
  requests_.reserve(capacity);
  capacity_ = capacity;
}

TouchedView BlockFinder::view() const {
  return {keys_.data(),
          directions_.data(),
          first_sums_.data(),
          static_cast<uint32_t>(2 * capacity_ - 1),
          static_cast<uint32_t>(capacity_),
          places_.data(),
          blocks_.data(),
          sum_owners_.data(),
          counters_.data()};
}

void BlockFinder::begin() {
  if (!is_prepared_) emptyTable(true);
  is_prepared_ = false;
}

void BlockFinder::prepare() {
  emptyTable(true);
  is_prepared_ = true;
}

/// Empties the table and zeroes the counters; the counter of surfels only if `counts_surfels`.
void BlockFinder::emptyTable(bool counts_surfels) {
  launch("emptyTableKernel", emptyTableKernel, blocksFor(2 * capacity_), kThreads, 0, stream_,
         view(), counts_surfels);
}

void BlockFinder::mark(const DeviceSensing& sensing, const DeviceSurfels& surfels) {
  launchOverlapped("markBlocksKernel", markBlocksKernel, blocksFor(surfels.room), kThreads, 0,
                   stream_, sensing, fusion_, surfels, view());
}

void BlockFinder::compare(const DeviceSensing& sensing, const MapView& map) {
  launchOverlapped("compareWithMapKernel", compareWithMapKernel, blocksFor(capacity_), kThreads, 0,
                   stream_, blockOfVoxel(sensing.frame().origin_voxel), map, view(),
                   pinned_counters_.data(), requests_.data());
  stream_.record(counted_);
}

const FrameCounters& BlockFinder::waitForCounters() {
  counted_.wait();
  return pinned_counters_[0];
}

void BlockFinder::grow() {
  // The number of blocks counted before the table was full is only a lower bound.
  size_t capacity = 2 * capacity_;
  while (capacity < pinned_counters_[0].touched) capacity *= 2;
  stream_.synchronize();
  allocate(capacity);
  emptyTable(false);
}

std::vector<BlockRequest> BlockFinder::fetchRequests() const {
  return {requests_.data(), requests_.data() + pinned_counters_[0].requests};
}

std::vector<PackedKey> BlockFinder::fetchTouched() {
  const uint32_t count = pinned_counters_[0].touched;
  if (count == 0) return {};
  touched_keys_.reserve(count);
  launch("readTouchedKernel", readTouchedKernel, blocksFor(count), kThreads, 0, stream_, view(),
         count, touched_keys_.data());
  stream_.synchronize();
  return {touched_keys_.data(), touched_keys_.data() + count};
}

void BlockFinder::addMemory(MapperMemory& memory) const {
  addScratch(memory, keys_, directions_, first_sums_, places_, sum_owners_, blocks_, requests_,
             touched_keys_);
}

}  // namespace gpu
}  // namespace dtsdf
