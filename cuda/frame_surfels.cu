#include "frame_surfels.h"

#include <algorithm>
#include <cstring>
#include <cub/block/block_scan.cuh>
#include <cub/warp/warp_scan.cuh>

#include "backend/fusion_view.h"
#include "kernels/surfels/depth_noise.h"
#include "launch.h"
#include "named_kernels.h"
#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kUploadBands = 4;
constexpr int kTileWidth = kThreads + 2 * kMaxNormalRadius_px;

struct DepthImage {
  const void* data;
  RawDepth raw;
  int32_t width, height;
  float min_depth_m, max_depth_m;
};

__device__ float inverseDepthAt(const DepthImage& image, int u, int v) {
  const int64_t i = static_cast<int64_t>(v) * image.width + u;
  const float value = image.raw.encoding == DepthEncoding::kUint16
                          ? static_cast<float>(static_cast<const uint16_t*>(image.data)[i])
                          : static_cast<const float*>(image.data)[i];
  return inverseDepth(value, image.raw.unit_m, image.min_depth_m, image.max_depth_m);
}

/// Counts a line of the frame, if it lies in the image, by the bin of its variance.
__device__ void countNoiseLine(const DepthImage& image, float depth_jump, int i, uint32_t* bins) {
  const NoisePoint at = noisePoint(i, image.width, image.height);
  if (at.u < kNoiseRadius || at.u + kNoiseRadius >= image.width) return;
  float line[kNoiseLength];
  for (int k = 0; k < kNoiseLength; ++k) {
    line[k] = inverseDepthAt(image, at.u + k - kNoiseRadius, at.v);
  }
  const float variance = varianceAboutLine(line, depth_jump);
  if (variance >= 0.0f) atomicAdd(&bins[noiseBin(variance)], 1u);
}

/// Takes the median out of the counts and leaves them zeroed, with the threads of one block.
__device__ void takeMedian(NoiseCounts& counts, float* noise) {
  using Scan = cub::BlockScan<uint32_t, kThreads>;
  __shared__ typename Scan::TempStorage scan;
  constexpr int kBinsPerThread = kNoiseBins / kThreads;
  static_assert(kNoiseBins % kThreads == 0, "each thread has as many bins");
  const int first_bin = threadIdx.x * kBinsPerThread;
  uint32_t in_bin[kBinsPerThread], own = 0, before, lines;
  for (int k = 0; k < kBinsPerThread; ++k) {
    in_bin[k] = readShared(&counts.bins[first_bin + k]);
    counts.bins[first_bin + k] = 0;
    own += in_bin[k];
  }
  if (threadIdx.x == 0) counts.finished = 0;
  Scan(scan).ExclusiveSum(own, before, lines);
  if (lines < kLeastNoiseLines) {
    if (threadIdx.x == 0) *noise = 0.0f;
    return;
  }
  const uint32_t rank = medianRank(lines);
  for (int k = 0; k < kBinsPerThread; before += in_bin[k++]) {
    if (before <= rank && rank < before + in_bin[k]) *noise = noiseOfBin(first_bin + k);
  }
}

/// One thread per line; the block of threads that finishes last takes the median.
__global__ void __launch_bounds__(kThreads) estimateNoiseKernel(DepthImage image, float depth_jump,
                                                               NoiseCounts* counts, float* noise) {
  __shared__ bool is_last;
  const size_t i = globalThread();
  if (i < kNoisePoints) countNoiseLine(image, depth_jump, static_cast<int>(i), counts->bins);
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) is_last = atomicAdd(&counts->finished, 1u) == gridDim.x - 1;
  __syncthreads();
  if (!is_last) return;
  __threadfence();
  takeMedian(*counts, noise);
}

/// A block of threads fits a stretch of one row. The tile has a margin in which pixels outside the
/// image count as unmeasured, which ends a walk just as the image's border does.
__global__ void fitRowsKernel(DepthImage image, NormalFitSettings settings, const float* noise,
                              float* inverse_depth,
                              float* row_value, float* row_slope) {
  __shared__ float tile[kTileWidth];
  settings.noise = *noise;
  const int first_u = blockIdx.x * blockDim.x, u = first_u + threadIdx.x;
  for (int v = blockIdx.y; v < image.height; v += gridDim.y) {
    for (int i = threadIdx.x; i < kTileWidth; i += blockDim.x) {
      const int tile_u = first_u + i - kMaxNormalRadius_px;
      tile[i] = tile_u >= 0 && tile_u < image.width ? inverseDepthAt(image, tile_u, v) : 0.0f;
    }
    __syncthreads();
    if (u < image.width) {
      const int64_t at = static_cast<int64_t>(v) * image.width + u;
      const RowFit fit = fitRow(tile, kTileWidth, threadIdx.x + kMaxNormalRadius_px, 0, settings);
      inverse_depth[at] = tile[threadIdx.x + kMaxNormalRadius_px];
      row_value[at] = fit.value;
      row_slope[at] = fit.slope;
    }
    __syncthreads();
  }
}

/// One thread per tile of pixels.
__global__ void groupTilesKernel(FrameView frame, GroupSettings settings, FitImages images,
                                 uint8_t* groups) {
  const int tiles_across = tilesAlong(frame.width);
  const size_t tile = globalThread();
  if (tile >= static_cast<size_t>(tiles_across) * tilesAlong(frame.height)) return;
  const int u = static_cast<int>(tile % tiles_across) * kTileSide;
  const int v = static_cast<int>(tile / tiles_across) * kTileSide;
  groups[tile] =
      static_cast<uint8_t>(groupTile(images, frame.width, frame.height, u, v, settings));
}

/// One surfel per pixel. `count` takes the number of those with a weight.
__global__ void computePixelsKernel(FrameView frame, NormalFitSettings settings, const float* noise,
                                    FitImages images, Surfel* surfels, uint32_t* count) {
  settings.noise = *noise;
  const int u = blockIdx.x * blockDim.x + threadIdx.x;
  int found = 0;
  for (int v = blockIdx.y; u < frame.width && v < frame.height; v += gridDim.y) {
    const Surfel surfel = computeSurfel(frame, images, u, v, settings);
    surfels[static_cast<int64_t>(v) * frame.width + u] = surfel;
    found += surfel.weight > 0.0f;
  }
  if (found > 0) atomicAdd(count, static_cast<uint32_t>(found));
}

/// A list of surfels that may find no room in it; `count` takes how many there are.
struct SurfelList {
  Surfel* surfels;
  uint32_t room;
  uint32_t* count;
};

/// The place of each lane's `wanted` surfels in the list, taken by a full warp with one atomic.
__device__ uint32_t takePlaces(uint32_t wanted, uint32_t* count) {
  using Scan = cub::WarpScan<uint32_t>;
  __shared__ typename Scan::TempStorage scan[kThreads / 32];
  uint32_t before, total, first = 0;
  Scan(scan[threadIdx.x / 32]).ExclusiveSum(wanted, before, total);
  if (threadIdx.x % 32 == 0 && total > 0) first = atomicAdd(count, total);
  __syncwarp();  // the scan's memory is used again for the next row
  return __shfl_sync(0xffffffffu, first, 0) + before;
}

/// One surfel per group, pixel, or part of a pixel; their order does not matter, since sums are
/// integers. And how far each pixel saw free space.
__global__ void computeGroupsKernel(FrameView frame, NormalFitSettings settings,
                                    FreeSpaceSettings free_space, const float* noise,
                                    FitImages images, const uint8_t* groups, SurfelList list,
                                    float* free_depth) {
  settings.noise = free_space.noise = *noise;
  const int u = blockIdx.x * blockDim.x + threadIdx.x;
  for (int v = blockIdx.y; v < frame.height; v += gridDim.y) {
    Surfel group = noSurfel();
    PixelMeasurement pixel{};
    uint32_t surfels = 0;
    if (u < frame.width) {
      free_depth[static_cast<int64_t>(v) * frame.width + u] =
          freeDepth(frame, images, u, v, free_space);
      const size_t tile =
          static_cast<size_t>(v / kTileSide) * tilesAlong(frame.width) + u / kTileSide;
      const int side = groupSide(groups[tile], u, v);
      if (side > 1) {
        group = computeGroupSurfel(frame, images, u, v, side, settings);
        surfels = group.weight > 0.0f;
      }
      if (side == 1) {
        const LineFit column = fitColumn(images, frame.width, frame.height, u, v, settings);
        pixel = dividedPixel(frame, images, u, v, column, settings);
        surfels = pixel.plane.trust > 0.0f ? partCount(pixel.parts) : 0;
      }
    }
    const uint32_t place = takePlaces(surfels, list.count);
    for (uint32_t i = 0; i < surfels && place + i < list.room; ++i) {
      list.surfels[place + i] = group.weight > 0.0f
                                    ? group
                                    : makePartSurfel(frame, images, pixel, static_cast<int>(i));
    }
  }
}

/// Without the noise, which only the device knows.
NormalFitSettings normalFitSettings(const MapperParams& params, const FrameView& view) {
  return makeNormalFitSettings(params, view, 0.0f);
}

/// A grid of stretches of rows.
dim3 rowGrid(const FrameView& view) {
  constexpr int kMaxGridRows = 65535;
  return dim3(blocksFor(view.width), std::min(view.height, kMaxGridRows));
}

size_t rowBytes(const DepthFrame& frame) {
  return static_cast<size_t>(frame.width) *
         (frame.encoding == DepthEncoding::kUint16 ? sizeof(uint16_t) : sizeof(float));
}

size_t tilesOf(const FrameView& view) {
  return static_cast<size_t>(tilesAlong(view.width)) * tilesAlong(view.height);
}

}  // namespace

FrameSurfels::FrameSurfels(const Stream& stream) : noise_(1), noise_counts_(1) {
  noise_counts_.zero(stream);
}

/// Copies rows of the image to pinned memory, packed.
void FrameSurfels::copyRows(const DepthFrame& frame, int begin, int end) {
  const size_t row = rowBytes(frame);
  const char* from = static_cast<const char*>(frame.data);
  if (frame.row_bytes == row) {
    std::memcpy(pinned_raw_.data() + begin * row, from + begin * row, (end - begin) * row);
    return;
  }
  for (int v = begin; v < end; ++v) {
    std::memcpy(pinned_raw_.data() + v * row, from + v * frame.row_bytes, row);
  }
}

/// In bands, so that each is on its way while the host copies the next. A profile tells the two
/// apart: with it, the image is one band.
void FrameSurfels::upload(const DepthFrame& frame, const Stream& stream) {
  const size_t row = rowBytes(frame);
  raw_bytes_ = row * frame.height;
  pinned_raw_.reserve(raw_bytes_);
  raw_.reserveExactly(raw_bytes_, stream);
  const int bands = profileOf(stream) == nullptr ? kUploadBands : 1;
  for (int i = 0; i < bands; ++i) {
    const int begin = frame.height * i / bands, end = frame.height * (i + 1) / bands;
    {
      const StageTimer timer(profileOf(stream), Stage::kCopy);
      copyRows(frame, begin, end);
    }
    holdForProfile(stream);
    const StageSpan span(stream, Stage::kUpload);
    raw_.uploadPart(pinned_raw_.data(), begin * row, end * row, stream);
  }
}

void FrameSurfels::fitRows(const RawDepth& raw, const FrameView& view, const MapperParams& params,
                           const Stream& stream) {
  const size_t pixels = static_cast<size_t>(view.width) * view.height;
  inverse_depth_.reserveExactly(pixels, stream);
  row_value_.reserveExactly(pixels, stream);
  row_slope_.reserveExactly(pixels, stream);
  free_depth_.reserveExactly(pixels, stream);
  groups_.reserveExactly(tilesOf(view), stream);
  surfels_.reserveExactly(pixels, stream);
  const DepthImage image{raw_.data(),  raw, view.width, view.height, params.fusion.min_depth_m,
                         params.fusion.max_depth_m};
  {
    const StageSpan span(stream, Stage::kNoise);
    estimateNoiseKernel<<<blocksFor(kNoisePoints), kThreads, 0, stream.get()>>>(
        image, params.fusion.depth_jump, noise_counts_.data(), noise_.data());
    DTSDF_CHECK_LAUNCH("estimateNoiseKernel");
  }
  const StageSpan span(stream, Stage::kRowFits);
  fitRowsKernel<<<rowGrid(view), kThreads, 0, stream.get()>>>(
      image, normalFitSettings(params, view), noise_.data(), inverse_depth_.data(),
      row_value_.data(), row_slope_.data());
  DTSDF_CHECK_LAUNCH("fitRowsKernel");
}

void FrameSurfels::computePixels(const RawDepth& raw, const FrameView& view,
                                 const MapperParams& params, uint32_t* count,
                                 const Stream& stream) {
  fitRows(raw, view, params, stream);
  const StageSpan span(stream, Stage::kSurfels);
  computePixelsKernel<<<rowGrid(view), kThreads, 0, stream.get()>>>(
      view, normalFitSettings(params, view), noise_.data(), images(), surfels_.data(), count);
  DTSDF_CHECK_LAUNCH("computePixelsKernel");
}

void FrameSurfels::computeGroups(const RawDepth& raw, const FrameView& view,
                                 const MapperParams& params, uint32_t* count,
                                 const Stream& stream) {
  fitRows(raw, view, params, stream);
  {
    const StageSpan span(stream, Stage::kGroups);
    groupTilesKernel<<<blocksFor(tilesOf(view)), kThreads, 0, stream.get()>>>(
        view, makeGroupSettings(params, view), images(), groups_.data());
    DTSDF_CHECK_LAUNCH("groupTilesKernel");
  }
  listSurfels(view, params, count, stream);
}

void FrameSurfels::makeRoom(uint32_t surfels, const FrameView& view, const MapperParams& params,
                            uint32_t* count, const Stream& stream) {
  surfels_.reserve(surfels, stream);
  listSurfels(view, params, count, stream);
}

void FrameSurfels::listSurfels(const FrameView& view, const MapperParams& params, uint32_t* count,
                               const Stream& stream) {
  const StageSpan span(stream, Stage::kSurfels);
  const SurfelList list{surfels_.data(), room(), count};
  computeGroupsKernel<<<rowGrid(view), kThreads, 0, stream.get()>>>(
      view, normalFitSettings(params, view), makeFreeSpaceSettings(params, 0.0f), noise_.data(),
      images(), groups_.data(), list, free_depth_.data());
  DTSDF_CHECK_LAUNCH("computeGroupsKernel");
}

void FrameSurfels::addMemory(std::vector<MemoryPart>& parts) const {
  const size_t bytes = raw_.bytes() + inverse_depth_.bytes() + row_value_.bytes() +
                       row_slope_.bytes() + free_depth_.bytes() + groups_.bytes() +
                       surfels_.bytes() + noise_counts_.bytes();
  parts.push_back({"images and surfels", MemoryKind::kScratch, bytes, bytes});
  parts.push_back({"raw image", MemoryKind::kStaging, pinned_raw_.bytes(), pinned_raw_.bytes()});
}

std::vector<NamedKernel> surfelKernels() {
  return {DTSDF_NAMED_KERNEL(estimateNoiseKernel, 0),
          DTSDF_NAMED_KERNEL(fitRowsKernel, 0), DTSDF_NAMED_KERNEL(groupTilesKernel, 0),
          DTSDF_NAMED_KERNEL(computeGroupsKernel, 0), DTSDF_NAMED_KERNEL(computePixelsKernel, 0)};
}

}  // namespace gpu
}  // namespace dtsdf
