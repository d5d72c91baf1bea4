#include "make_surfels.h"

#include <cub/warp/warp_scan.cuh>

#include "backend/rule_settings.h"
#include "launch.h"

namespace dtsdf {
namespace gpu {
namespace {

/// Threads per thread block of makeSurfelsKernel(). The width of most images is a multiple of this.
constexpr int kRowThreads = 128;

/// Threads per patch of pixels. Five of them test whether to merge the whole patch or one of its
/// four quads.
constexpr uint32_t kPatchThreads = 8;
static_assert(kPatchBit < kPatchThreads && 32 % kPatchThreads == 0, "a patch must lie in one warp");

__global__ void mergePatchesKernel(ImageView image, SurfelSettings settings, uint8_t* patches) {
  waitForPreviousKernel();
  const int patches_across = patchesAlong(image.frame.width);
  const size_t patch = globalThread() / kPatchThreads;
  const bool is_patch =
      patch < static_cast<size_t>(patches_across) * patchesAlong(image.frame.height);
  const uint32_t bit = threadIdx.x % kPatchThreads, lane = threadIdx.x % 32;
  const Pixel first{static_cast<int>(patch % patches_across) * kPatchSide,
                    static_cast<int>(patch / patches_across) * kPatchSide};
  const bool is_merged =
      is_patch && bit <= kPatchBit && isBitMerged(image, first, static_cast<int>(bit), settings);
  const uint32_t bits = __ballot_sync(~0u, is_merged) >> (lane - bit);
  if (is_patch && bit == 0) patches[patch] = static_cast<uint8_t>(wholeOrQuads(bits));
}

/// Makes one surfel per pixel. Adds the number of surfels with a weight to `count`.
__global__ void makePixelSurfelsKernel(DeviceSensing on_device, SurfelSettings settings,
                                       Surfel* surfels, uint32_t* count) {
  const FrameSensing sensing = on_device.load();
  const FrameView& frame = sensing.image.frame;
  const int u = blockIdx.x * blockDim.x + threadIdx.x;
  int found = 0;
  for (int v = blockIdx.y; u < frame.width && v < frame.height; v += gridDim.y) {
    const Surfel surfel = makePixelSurfel(sensing, {u, v}, settings);
    surfels[pixelIndex(frame, {u, v})] = surfel;
    found += surfel.weight > 0.0f;
  }
  if (found > 0) atomicAdd(count, static_cast<uint32_t>(found));
}

/// Reserves `wanted` places in the list for each thread, with one atomic per warp. All threads of a
/// warp must call it. @return the thread's first place.
__device__ uint32_t reservePlaces(uint32_t wanted, uint32_t* count) {
  using Scan = cub::WarpScan<uint32_t>;
  __shared__ typename Scan::TempStorage scan[kRowThreads / 32];
  uint32_t before, total, first = 0;
  Scan(scan[threadIdx.x / 32]).ExclusiveSum(wanted, before, total);
  if (threadIdx.x % 32 == 0 && total > 0) first = atomicAdd(count, total);
  __syncwarp();  // the scan's memory is reused for the next row
  return __shfl_sync(0xffffffffu, first, 0) + before;
}

/// Makes one surfel per merged square, unmerged pixel or subpixel. Their order does not matter,
/// since they are added to integer sums. Adds the number of surfels to `count`, including those
/// that do not fit.
__global__ void __launch_bounds__(kRowThreads, 8)
    makeSurfelsKernel(DeviceSensing on_device, SurfelSettings settings, const uint8_t* patches,
                      Surfel* surfels, uint32_t room, uint32_t* count) {
  waitForPreviousKernel();
  const FrameSensing sensing = on_device.load();
  const FrameView& frame = sensing.image.frame;
  const int u = blockIdx.x * blockDim.x + threadIdx.x;
  for (int v = blockIdx.y; v < frame.height; v += gridDim.y) {
    const size_t patch =
        static_cast<size_t>(v / kPatchSide) * patchesAlong(frame.width) + u / kPatchSide;
    const int side = u < frame.width ? mergedSide(patches[patch], {u, v}) : 0;
    Surfel merged = noSurfel();  // from a square that starts at the pixel
    PixelMeasurement single{};
    uint32_t found = 0;
    if (side > 1) {
      merged = makeMergedSurfel(sensing, {{u, v}, side}, settings);
      found = merged.weight > 0.0f;
    }
    if (side == 1) {
      single = subdividedPixel(sensing, {u, v}, fitColumn(sensing, {u, v}, settings), settings);
      found = single.plane.trust > 0.0f ? subpixelCount(single.subdivision) : 0;
    }
    const uint32_t place = reservePlaces(found, count);
    for (uint32_t i = 0; i < found && place + i < room; ++i) {
      surfels[place + i] = merged.weight > 0.0f
                               ? merged
                               : makeSubpixelSurfel(sensing.image, single, static_cast<int>(i));
    }
  }
}

size_t patchesOf(const FrameView& frame) {
  return static_cast<size_t>(patchesAlong(frame.width)) * patchesAlong(frame.height);
}

}  // namespace

SurfelMaker::SurfelMaker(const MapperParams& params, const SurfelRules& rules, const Stream& stream)
    : merges_(castsSurfels(params)),
      surfel_settings_(makeSurfelSettings(params, rules)),
      stream_(stream) {}

void SurfelMaker::mergePixels(const DeviceSensing& sensing) {
  const size_t patches = patchesOf(sensing.frame());
  patches_.reserveExactly(patches, stream_);
  launchOverlapped("mergePatchesKernel", mergePatchesKernel, blocksFor(patches * kPatchThreads),
                   kThreads, 0, stream_, sensing.image(), surfel_settings_, patches_.data());
}

DeviceSurfels SurfelMaker::makeSurfels(const DeviceSensing& sensing, uint32_t* count) {
  const FrameView& frame = sensing.frame();
  const size_t pixels = static_cast<size_t>(frame.width) * frame.height;
  surfels_.reserveExactly(pixels, stream_);
  if (!merges_) {
    launch("makePixelSurfelsKernel", makePixelSurfelsKernel, rowGrid(frame), kThreads, 0, stream_,
           sensing, surfel_settings_, surfels_.data(), count);
    return {surfels_.data(), static_cast<uint32_t>(pixels), nullptr};
  }
  mergePixels(sensing);
  return listSurfels(sensing, count);
}

DeviceSurfels SurfelMaker::remakeSurfels(const DeviceSensing& sensing, uint32_t surfels,
                                         uint32_t* count) {
  surfels_.reserve(surfels, stream_);
  return listSurfels(sensing, count);
}

DeviceSurfels SurfelMaker::listSurfels(const DeviceSensing& sensing, uint32_t* count) {
  const uint32_t room = static_cast<uint32_t>(surfels_.capacity());
  launchOverlapped("makeSurfelsKernel", makeSurfelsKernel, rowGrid(sensing.frame(), kRowThreads),
                   kRowThreads, 0, stream_, sensing, surfel_settings_, patches_.data(),
                   surfels_.data(), room, count);
  return {surfels_.data(), room, count};
}

void SurfelMaker::addMemory(MapperMemory& memory) const { addScratch(memory, patches_, surfels_); }

}  // namespace gpu
}  // namespace dtsdf
