#include "paint.h"

#include <algorithm>

#include "backend/frame_check.h"
#include "device_map.cuh"
#include "launch.h"
#include "map/sort_by_key.h"
#include "runtime/device.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kThreadBlocksPerProcessor = 16;

/// Merges the requests for a block's arrays into one per block, in ascending order of keys.
std::vector<ColourRequest> byBlocks(std::vector<ColourRequest> requests) {
  sortByKey(requests);
  size_t blocks = 0;
  for (const ColourRequest& request : requests) {
    if (blocks > 0 && requests[blocks - 1].key == request.key) {
      requests[blocks - 1].bricks |= request.bricks;
    } else {
      requests[blocks++] = request;
    }
  }
  requests.resize(blocks);
  return requests;
}

/// One thread per pixel.
__global__ void takePixelsKernel(const uint8_t* raw, PixelLayout layout, ColourPixel* pixels,
                                 size_t count) {
  const size_t i = globalThread();
  if (i < count) pixels[i] = takePixel(raw + i * layout.bytes, layout);
}

/// One thread per pixel of a pyramid level, in a grid-stride loop.
__global__ void halveImageKernel(ColourImage image, ColourPixel* pixels, int level) {
  const ColourLevel& to = image.level[level];
  const size_t count = static_cast<size_t>(to.width) * to.height;
  for (size_t i = globalThread(); i < count; i += static_cast<size_t>(gridDim.x) * blockDim.x) {
    pixels[to.first + i] = halvedPixel(image, level, static_cast<int32_t>(i % to.width),
                                       static_cast<int32_t>(i / to.width));
  }
}

/// One thread per cell of kCellSide x kCellSide pixels.
__global__ void clearHidingKernel(float* depth_m, size_t cells) {
  const size_t i = globalThread();
  if (i < cells) depth_m[i] = kNoSurface_m;
}

/// One thread per candidate: lists the voxel arrays in view.
__global__ void findArraysInViewKernel(PointView view, MapView map, PaintView paint) {
  const size_t i = globalThread();
  if (i >= paint.candidate_count) return;
  const int32_t slot = paint.candidates[i];
  const SlotEntry& entry = map.slots[slot];
  if (entry.key == kNoKey) return;
  const BlockKey origin = blockOfVoxel(view.frame.origin_voxel);
  if (!mayBeInView(view.frame, unpackKey(entry.key) - origin, pointRadius(view.rules))) return;
  atomicAdd(&paint.counters->blocks, 1u);
  const uint32_t directions = directionsOfSlot(entry);
  uint32_t n = atomicAdd(&paint.counters->arrays, static_cast<uint32_t>(__popc(directions)));
  for (int d = 0; d < kDirectionCount; ++d) {
    if (directions >> d & 1u) paint.arrays[n++] = kDirectionCount * slot + d;
  }
}

__device__ Vec3f firstVoxelOf(const FrameView& frame, const SlotEntry& entry) {
  return toFloat(firstVoxelOfBlock(unpackKey(entry.key) - blockOfVoxel(frame.origin_voxel)));
}

/// Threads per thread block in kernels that process one voxel array at a time. This is less than
/// the number of voxels, as only a few of them must be processed.
constexpr int kArrayThreads = 128;

struct ArrayInView {
  int32_t slot, direction, array;
  PackedKey key;
  const Voxel* voxels;
  Vec3f first_voxel_L;
};

/// Calls visit(ArrayInView) for every array in view that this thread block processes.
template <class Visit>
__device__ void visitArrays(const FrameView& frame, const MapView& map, const PaintView& paint,
                            const Visit& visit) {
  const uint32_t count = paint.counters->arrays;
  for (uint32_t n = blockIdx.x; n < count; n += gridDim.x) {
    const int32_t slot = paint.arrays[n] / kDirectionCount;
    const int32_t direction = paint.arrays[n] % kDirectionCount;
    const SlotEntry& entry = map.slots[slot];
    const int32_t array = entry.array[direction];
    visit(
        {slot, direction, array, entry.key, map.voxels.record(array), firstVoxelOf(frame, entry)});
  }
}

/// The voxels of an array that must be processed, in a list, so that all threads have work.
struct VoxelList {
  uint32_t count;
  uint16_t voxel[kVoxelsPerBlock];
};

/// Lists the voxels of an array that lie near its surface and for which wanted(index) is true. All
/// threads of the thread block must call it.
template <class Wanted>
__device__ void listNearSurface(const PointView& view, const ArrayInView& array,
                                const Wanted& wanted, VoxelList& list) {
  static_assert(kVoxelsPerBlock % kArrayThreads == 0, "warps must not diverge");
  constexpr int kSteps = kVoxelsPerBlock / kArrayThreads;
  __syncthreads();
  if (threadIdx.x == 0) list.count = 0;
  __syncthreads();
  bool is_near[kSteps];
#pragma unroll  // all reads are issued before the first is needed
  for (int step = 0; step < kSteps; ++step) {
    const Voxel& voxel = array.voxels[threadIdx.x + step * kArrayThreads];
    is_near[step] = isNearSurface(view, voxel);
  }
#pragma unroll
  for (int step = 0; step < kSteps; ++step) {
    const int i = threadIdx.x + step * kArrayThreads;
    const bool is_wanted = is_near[step] && wanted(i);
    const unsigned all = __ballot_sync(~0u, is_wanted);
    const int lane = threadIdx.x % warpSize;
    uint32_t first = 0;
    if (lane == 0 && all != 0) first = atomicAdd(&list.count, __popc(all));
    first = __shfl_sync(~0u, first, 0);
    if (is_wanted) {
      list.voxel[first + __popc(all & ((1u << lane) - 1))] = static_cast<uint16_t>(i);
    }
  }
  __syncthreads();
}

/// Lowers a depth to `value`, if that is less. The bits of positive floats, read as integers,
/// compare like the floats. An outdated read does no harm, since depths only decrease.
__device__ void lowerTo(float* depth_m, float value) {
  if (!(value < readShared(depth_m))) return;
  atomicMin(reinterpret_cast<int*>(depth_m), __float_as_int(value));
}

/// One thread block per array in view, in a grid-stride loop.
__global__ void __launch_bounds__(kArrayThreads, 8)
    drawHidingKernel(PointView view, MapView map, PaintView paint, float* depth_m) {
  waitForPreviousKernel();
  __shared__ VoxelList list;
  visitArrays(view.frame, map, paint, [&](const ArrayInView& array) {
    listNearSurface(
        view, array, [&](int i) { return hides(view, array.voxels, i, array.direction); }, list);
    for (uint32_t n = threadIdx.x; n < list.count; n += kArrayThreads) {
      SurfacePoint point;
      if (!findSurfacePoint(view, array.first_voxel_L, array.voxels, list.voxel[n], array.direction,
                            point)) {
        continue;
      }
      drawSurface(view, point,
                  [&](int32_t cell, float cell_m) { lowerTo(depth_m + cell, cell_m); });
    }
  });
}

__device__ void addAtomically(int64_t* sum, int64_t value) {
  atomicAdd(reinterpret_cast<unsigned long long*>(sum), static_cast<unsigned long long>(value));
}

/// Results for the voxels of one array that are visible in an image.
struct SeenArray {
  ExposureSums sums;
  unsigned long long lacking;  ///< Bits of missing bricks (4 x 4 x 4 voxels) to be painted.
  uint32_t samples;
};

/// The sum over a warp, valid in its first thread. All threads of the warp must call it.
__device__ int32_t warpSum(int32_t value) {
  for (int lanes = 16; lanes > 0; lanes /= 2) value += __shfl_down_sync(~0u, value, lanes);
  return value;
}

/// Adds the sum of `part` over a warp. It fits in 32 bits, as all parts come from one array.
__device__ void addWarpSum(int64_t* to, int64_t part) {
  const int32_t sum = warpSum(static_cast<int32_t>(part));
  if (threadIdx.x % warpSize == 0) addAtomically(to, sum);
}

/// Adds each thread's sums to `sums`, in shared memory. All threads must call it.
__device__ void addWarpSums(ExposureSums& sums, const ExposureSums& part) {
  static_assert(kVoxelsPerBlock * 255 * 255 < (1 << 30), "an array's sums fit in 32 bits");
  if (!__any_sync(~0u, part.voxels != 0)) return;
  visitSums(sums, part, [](int64_t& sum, int64_t of_thread) { addWarpSum(&sum, of_thread); });
}

/// Adds what was found in an array to the image's counters. Called by one thread.
__device__ void report(const PaintView& paint, PackedKey key, const SeenArray& found) {
  if (found.samples == 0) return;
  PaintCounters& counters = *paint.counters;
  atomicAdd(&counters.seen, 1u);
  if (found.sums.voxels != 0) {
    visitSums(counters.sums, found.sums,
              [](int64_t& sum, int64_t of_array) { addAtomically(&sum, of_array); });
  }
  if (found.lacking == 0) return;
  paint.requests[atomicAdd(&counters.requests, 1u)] = {key, found.lacking};
}

/// Counts a sample, and stores it if there is room.
__device__ void keepSample(const PaintView& paint, const FoundSample& found) {
  const unsigned long long n =
      atomicAdd(reinterpret_cast<unsigned long long*>(&paint.counters->samples), 1ull);
  if (n < paint.max_samples) paint.samples[n] = found;
}

__device__ void inspectVoxel(const ColourSensing& sensing, const MapView& map,
                             const PaintView& paint, const ArrayInView& array, int voxel,
                             ExposureSums& sums, SeenArray& found) {
  const ColourSample sample =
      sampleColour(sensing, array.first_voxel_L, array.voxels, voxel, array.direction);
  if (!(sample.weight > 0.0f)) return;
  keepSample(paint, {array.slot, static_cast<uint16_t>(array.direction * kVoxelsPerBlock + voxel),
                     sample});
  atomicAdd(&found.samples, 1u);
  const VoxelColour* colour = colourOf(map, array.array, voxel);
  if (colour == nullptr) {
    atomicOr(&found.lacking, static_cast<unsigned long long>(brickBit(array.direction, voxel)));
    return;
  }
  const VoxelColour seen{sample.red, sample.green, sample.blue, 0};
  if (isUsableForExposure(*colour, seen, sample.weight, sensing.view.rules)) {
    addToSums(sums, *colour, seen);
  }
}

/// One thread block per array in view, in a grid-stride loop.
__global__ void __launch_bounds__(kArrayThreads, 8)
    findColoursKernel(ColourSensing sensing, MapView map, PaintView paint) {
  waitForPreviousKernel();
  __shared__ SeenArray found;
  __shared__ VoxelList list;
  const PointView& view = sensing.view;
  visitArrays(view.frame, map, paint, [&](const ArrayInView& array) {
    if (!paint.painted.contains(unpackKey(array.key))) return;  // all threads, or none
    if (threadIdx.x == 0) found = {};
    listNearSurface(
        view, array, [](int) { return true; }, list);
    ExposureSums sums = {};
    for (uint32_t n = threadIdx.x; n < list.count; n += kArrayThreads) {
      inspectVoxel(sensing, map, paint, array, list.voxel[n], sums, found);
    }
    __syncwarp();
    addWarpSums(found.sums, sums);
    __syncthreads();
    if (threadIdx.x == 0) report(paint, array.key, found);
    __syncthreads();
  });
}

/// One thread per sample. Runs after the missing bricks have been added.
__global__ void paintKernel(ColourRules rules, Exposure exposure, MapView map,
                            const FoundSample* samples, size_t count) {
  waitForPreviousKernel();
  const size_t n = globalThread();
  if (n >= count) return;
  const FoundSample found = samples[n];
  const int32_t array = map.slots[found.slot].array[found.voxel / kVoxelsPerBlock];
  VoxelColour* colour = colourOf(map, array, found.voxel % kVoxelsPerBlock);
  if (colour == nullptr) return;
  const VoxelColour painted = paintedColour(*colour, found.sample, exposure, rules);
  if (looksDifferent(*colour, painted)) mark(map.painted, found.slot);
  *colour = painted;
}

}  // namespace

Painter::Painter(const PaintSettings& settings, const Stream& stream)
    : settings_(settings),
      stream_(stream),
      thread_blocks_(kThreadBlocksPerProcessor * multiprocessorCount()),
      counters_(1),
      pinned_counters_(1) {}

void Painter::reserveImages(int32_t width, int32_t height) {
  const ColourImage layout = layOut(nullptr, width, height);
  pixels_.reserveExactly(static_cast<size_t>(pixelCount(layout)), image_stream_);
  hiding_m_.reserveExactly(static_cast<size_t>(cellsFor(width)) * cellsFor(height), image_stream_);
  // Initially one sample per pixel, as visible voxels rarely outnumber pixels.
  samples_.reserveExactly(static_cast<size_t>(width) * height, stream_);
  sensing_.image = layOut(pixels_.data(), width, height);
  sensing_.hiding_m = hiding_m_.data();
}

/// No kernel reads the previous image any longer, as findSamples() has waited for its counters. If
/// findColours() threw an exception before that, this function waits.
void Painter::takeImage(const ColourFrame& frame) {
  if (is_finding_) stream_.synchronize();
  is_finding_ = false;
  reserveImages(frame.width, frame.height);
  const size_t cells = static_cast<size_t>(cellsFor(frame.width)) * cellsFor(frame.height);
  launch("clearHidingKernel", clearHidingKernel, blocksFor(cells), kThreads, 0, image_stream_,
         hiding_m_.data(), cells);
  raw_image_.upload(frame, image_stream_);
  const size_t pixels = static_cast<size_t>(frame.width) * frame.height;
  launch("takePixelsKernel", takePixelsKernel, blocksFor(pixels), kThreads, 0, image_stream_,
         raw_image_.data(), layoutOf(frame.encoding), pixels_.data(), pixels);
  for (int level = 1; level < kColourLevels; ++level) {
    const ColourLevel& to = sensing_.image.level[level];
    const size_t count = static_cast<size_t>(to.width) * to.height;
    launch("halveImageKernel", halveImageKernel, blocksFor(count), kThreads, 0, image_stream_,
           sensing_.image, pixels_.data(), level);
  }
  image_stream_.record(taken_);
}

void Painter::findColours(const FrameView& view, int32_t min_evidence,
                          const std::vector<int32_t>& in_view, const BlockExtent& painted,
                          const MapView& map) {
  painted_ = painted;
  sensing_.view = {settings_, view, min_evidence};
  takeCandidates(in_view);
  stream_.waitFor(taken_);
  findHiding(map);
  findSamples(map);
  while (counters().samples > samples_.capacity()) {
    samples_.reserve(counters().samples, stream_);
    findHiding(map);
    findSamples(map);
  }
}

/// No kernel reads the previous image's candidates any longer; see takeImage().
void Painter::takeCandidates(const std::vector<int32_t>& in_view) {
  candidate_count_ = static_cast<uint32_t>(in_view.size());
  candidates_.reserve(in_view.size());
  arrays_.reserve(in_view.size() * kDirectionCount, stream_);
  requests_.reserve(in_view.size() * kDirectionCount, stream_);
  std::copy(in_view.begin(), in_view.end(), candidates_.data());
}

void Painter::findHiding(const MapView& map) {
  is_finding_ = true;
  counters_.zero(stream_);
  if (candidate_count_ > 0) {
    launch("findArraysInViewKernel", findArraysInViewKernel, blocksFor(candidate_count_), kThreads,
           0, stream_, sensing_.view, map, view());
  }
  launchOverlapped("drawHidingKernel", drawHidingKernel, thread_blocks_, kArrayThreads, 0, stream_,
                   sensing_.view, map, view(), hiding_m_.data());
}

void Painter::findSamples(const MapView& map) {
  launchOverlapped("findColoursKernel", findColoursKernel, thread_blocks_, kArrayThreads, 0,
                   stream_, sensing_, map, view());
  counters_.download(pinned_counters_.data(), 1, stream_);
  stream_.record(found_);
  found_.wait();
  is_finding_ = false;
}

std::vector<ColourRequest> Painter::fetchRequests() {
  const size_t count = counters().requests;
  if (count == 0) return {};
  pinned_requests_.reserve(count);
  requests_.download(pinned_requests_.data(), count, stream_);
  stream_.synchronize();
  return byBlocks({pinned_requests_.data(), pinned_requests_.data() + count});
}

void Painter::paint(const Exposure& exposure, const MapView& map) {
  const size_t samples = counters().samples;
  if (samples == 0) return;
  launchOverlapped("paintKernel", paintKernel, blocksFor(samples), kThreads, 0, stream_,
                   settings_.rules, exposure, map, samples_.data(), samples);
}

void Painter::addMemory(MapperMemory& memory) const {
  addScratch(memory, pixels_, hiding_m_, samples_, arrays_, requests_, counters_, pinned_counters_,
             pinned_requests_, candidates_);
  raw_image_.addMemory(memory);
}

}  // namespace gpu
}  // namespace dtsdf
