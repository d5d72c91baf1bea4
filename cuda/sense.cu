#include "sense.h"

#include <cub/block/block_scan.cuh>

#include "backend/rule_settings.h"
#include "kernels/fusion/free_space.h"
#include "kernels/surfels/line_fit.h"
#include "launch.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kStretchWidth = kThreads + 2 * kMaxNormalRadius_px;

/// One thread per pixel.
__device__ void invertDepths(const RawDepth& raw, float* measured) {
  const int u = blockIdx.x * blockDim.x + threadIdx.x;
  for (int v = blockIdx.y; u < raw.width && v < raw.height; v += gridDim.y) {
    measured[static_cast<int64_t>(v) * raw.width + u] = inverseDepthAt(raw, u, v);
  }
}

constexpr int kNoiseLines = kNoisePoints * kNoiseSteps;

/// Counts a line of pixels in the bin of its variance, if noise can be estimated from the line.
__device__ void countNoiseLine(const RawDepth& raw, const SurfelSettings& surfels, int i,
                               NoiseCounts& counts) {
  const auto measured = [&](int u, int v) { return inverseDepthAt(raw, u, v); };
  const NoiseLinePlace place =
      noiseLinePlace(i % kNoisePoints, i / kNoisePoints, raw.width, raw.height);
  float line[kNoiseLength];
  if (!readNoiseLine(measured, raw.width, raw.height, place, line)) return;
  const float variance = noiseVariance(line, surfels);
  if (variance >= 0.0f) atomicAdd(&counts.bins[place.kind][noiseBin(variance)], 1u);
}

/// Computes the quartiles from the counts, and zeroes the counts. Without lines, quartiles are 0.
/// All threads of one thread block must call it.
__device__ void takeQuartiles(NoiseCounts& counts, NoiseOfLines (&kinds)[kNoiseKinds]) {
  using Scan = cub::BlockScan<uint64_t, kThreads>;
  __shared__ typename Scan::TempStorage scan;
  constexpr int kBinsPerThread = kNoiseBins / kThreads;
  static_assert(kNoiseBins % (4 * kThreads) == 0, "threads read bins in fours");
  constexpr int kBits = 12;  // per kind, except the last one, which has twice as many lines
  constexpr uint64_t kMask = (uint64_t{1} << kBits) - 1;
  static_assert(kShortLines * kBits + 13 <= 64 && kNoisePoints < 1 << 13, "must fit in 64 bits");
  static_assert(kNoisePoints / 2 <= kMask, "a count must fit in kBits");
  const auto field = [](uint64_t counts_of_kinds, int kind) {
    const uint64_t from = counts_of_kinds >> (kBits * kind);
    return static_cast<uint32_t>(kind < kShortLines ? from & kMask : from);
  };
  const int first_bin = threadIdx.x * kBinsPerThread;
  uint32_t in_bin[kNoiseKinds][kBinsPerThread];
  uint64_t own = 0, before, lines;
#pragma unroll  // all reads are issued before the first is needed
  for (int kind = 0; kind < kNoiseKinds; ++kind) {
    for (int k = 0; k < kBinsPerThread; k += 4) {
      auto* const bins = reinterpret_cast<uint4*>(&counts.bins[kind][first_bin + k]);
      const uint4 four = __ldcg(bins);  // bypasses the L1 cache, as isLastBlock() requires
      in_bin[kind][k] = four.x;
      in_bin[kind][k + 1] = four.y;
      in_bin[kind][k + 2] = four.z;
      in_bin[kind][k + 3] = four.w;
      *bins = {};
    }
  }
#pragma unroll
  for (int kind = 0; kind < kNoiseKinds; ++kind) {
    for (const uint32_t count : in_bin[kind]) own += uint64_t{count} << (kBits * kind);
  }
  if (threadIdx.x < kNoiseKinds) kinds[threadIdx.x] = {};
  Scan(scan).ExclusiveSum(own, before, lines);
#pragma unroll
  for (int kind = 0; kind < kNoiseKinds; ++kind) {
    const uint32_t count = field(lines, kind), first = field(before, kind);
    if (threadIdx.x == 0) kinds[kind].lines = count;
    uint32_t up_to[kBinsPerThread];  // lines in and below each bin
    for (int k = 0; k < kBinsPerThread; ++k)
      up_to[k] = (k > 0 ? up_to[k - 1] : first) + in_bin[kind][k];
    for (int quartile = 0; quartile < kNoiseQuartiles; ++quartile) {
      const uint32_t rank = quartileRank(count, quartile);
      if (rank < first || rank >= up_to[kBinsPerThread - 1]) continue;
      int bin = first_bin;
      for (const uint32_t lines_up_to : up_to) bin += rank < lines_up_to ? 0 : 1;
      kinds[kind].quartiles[quartile] = noiseOfBin(bin, quartile);
    }
  }
}

/// Number of thread blocks that count one noise line per thread. Grids of small images have fewer.
constexpr unsigned kNoiseBlocks = kNoiseLines / kThreads;
static_assert(kNoiseLines % kThreads == 0, "one line per thread");

/// One thread per pixel. The first kNoiseBlocks thread blocks, or all if there are fewer, also
/// count noise lines. The last thread block that has counted lines estimates the noise.
__global__ void __launch_bounds__(kThreads)
    invertDepthsKernel(RawDepth raw, SurfelSettings surfels, float* measured, NoiseCounts* counts,
                       DepthNoise* noise) {
  __shared__ NoiseOfLines kinds[kNoiseKinds];
  const unsigned blocks = gridDim.x * gridDim.y, block = blockIdx.x + gridDim.x * blockIdx.y;
  const unsigned noise_blocks = blocks < kNoiseBlocks ? blocks : kNoiseBlocks;
  for (unsigned part = block; part < kNoiseBlocks; part += noise_blocks) {
    countNoiseLine(raw, surfels, static_cast<int>(part * kThreads + threadIdx.x), *counts);
  }
  invertDepths(raw, measured);
  if (block >= noise_blocks || !isLastBlock(&counts->finished, noise_blocks)) return;
  takeQuartiles(*counts, kinds);
  __syncthreads();
  if (threadIdx.x != 0) return;
  counts->finished = 0;
  *noise = {combinedNoise(kinds, surfels.rules), surfels.noise_in_depth};
}

/// One thread per pixel.
__global__ void fillGapsKernel(const float* measured, int32_t width, int32_t height,
                               DepthRange range, SurfelSettings surfels, const DepthNoise* noise,
                               float* inverse_depth) {
  waitForPreviousKernel();
  const DepthNoise of_image = *noise;
  const auto measured_at = [&](int u, int v) {
    return measured[static_cast<int64_t>(v) * width + u];
  };
  const int u = blockIdx.x * blockDim.x + threadIdx.x;
  for (int v = blockIdx.y; u < width && v < height; v += gridDim.y) {
    inverse_depth[static_cast<int64_t>(v) * width + u] = filledInverseDepth(
        measured_at, width, height, {u, v}, surfels, of_image, range.rounded_to_m);
  }
}

/// Each thread block links and fits the pixels of one stretch of a row at a time. A stretch may
/// extend beyond the image; pixels there count as unmeasured, so fits end at the image border.
__global__ void fitRowsKernel(ImageView image, SurfelSettings surfels, const DepthNoise* noise,
                              float* row_value, float* row_slope, PixelLinks* row_links) {
  waitForPreviousKernel();
  __shared__ float stretch[kStretchWidth];
  __shared__ PixelLinks links[kStretchWidth];
  const FrameView& frame = image.frame;
  const FitWindow window = fitWindow(frame, *noise, surfels);
  const LinkLimits limits = linkLimits(frame, *noise, surfels);
  const int first_u = blockIdx.x * blockDim.x, u = first_u + threadIdx.x;
  for (int v = blockIdx.y; v < frame.height; v += gridDim.y) {
    for (int i = threadIdx.x; i < kStretchWidth; i += blockDim.x) {
      const int stretch_u = first_u + i - kMaxNormalRadius_px;
      const bool is_inside = stretch_u >= 0 && stretch_u < frame.width;
      stretch[i] = is_inside ? image.inverse_depth[pixelIndex(frame, {stretch_u, v})] : 0.0f;
      links[i] =
          is_inside ? linksOf(frame, image.inverse_depth, {stretch_u, v}, limits) : PixelLinks{0};
    }
    __syncthreads();
    if (u < frame.width) {
      const int in_stretch = threadIdx.x + kMaxNormalRadius_px;
      const LineFit fit = fitRow(stretch, links, kStretchWidth, in_stretch, window);
      const int64_t at = pixelIndex(frame, {u, v});
      row_value[at] = fit.value;
      row_slope[at] = fit.slope;
      row_links[at] = links[in_stretch];
    }
    __syncthreads();
  }
}

/// Finds the depth up to which each pixel's ray is free. May overlap the previous kernel, which
/// casts surfels: everything read here was written by earlier kernels.
__global__ void findFreeDepthsKernel(DeviceSensing on_device, FusionSettings fusion,
                                     float* free_depth) {
  const FrameSensing sensing = on_device.load();
  const FrameView& frame = sensing.image.frame;
  const int u = blockIdx.x * blockDim.x + threadIdx.x;
  for (int v = blockIdx.y; u < frame.width && v < frame.height; v += gridDim.y) {
    free_depth[pixelIndex(frame, {u, v})] = freeDepth(sensing, {u, v}, fusion);
  }
  waitAtEnd();
}

}  // namespace

FrameSensor::FrameSensor(const MapperParams& params, const Rules& rules, const Stream& stream)
    : clears_(clearsFreeSpace(params)),
      finds_free_(needsFreeDepth(params)),
      surfel_settings_(makeSurfelSettings(params, rules.surfels)),
      fusion_settings_(makeFusionSettings(params, rules)),
      stream_(stream),
      noise_(1),
      noise_counts_(1) {
  noise_counts_.zero(stream);
}

void FrameSensor::reserve(size_t pixels) {
  measured_.reserveExactly(pixels, stream_);
  inverse_depth_.reserveExactly(pixels, stream_);
  row_value_.reserveExactly(pixels, stream_);
  row_slope_.reserveExactly(pixels, stream_);
  free_depth_.reserveExactly(pixels, stream_);
  links_.reserveExactly(pixels, stream_);
}

DeviceSensing FrameSensor::sense(const FrameView& frame, const RawDepth& raw) {
  reserve(static_cast<size_t>(frame.width) * frame.height);
  const ImageView image{frame, inverse_depth_.data(), row_value_.data(), row_slope_.data(),
                        links_.data()};
  launch("invertDepthsKernel", invertDepthsKernel, rowGrid(frame), kThreads, 0, stream_, raw,
         surfel_settings_, measured_.data(), noise_counts_.data(), noise_.data());
  launchOverlapped("fillGapsKernel", fillGapsKernel, rowGrid(frame), kThreads, 0, stream_,
                   measured_.data(), frame.width, frame.height, raw.range, surfel_settings_,
                   noise_.data(), inverse_depth_.data());
  launchOverlapped("fitRowsKernel", fitRowsKernel, rowGrid(frame), kThreads, 0, stream_, image,
                   surfel_settings_, noise_.data(), row_value_.data(), row_slope_.data(),
                   links_.data());
  return {image, noise_.data(), clears_ ? free_depth_.data() : nullptr};
}

void FrameSensor::findFreeDepths(const DeviceSensing& sensing) {
  if (!finds_free_) return;
  launchOverlapped("findFreeDepthsKernel", findFreeDepthsKernel, rowGrid(sensing.frame()), kThreads,
                   0, stream_, sensing, fusion_settings_, free_depth_.data());
}

void FrameSensor::addMemory(MapperMemory& memory) const {
  addScratch(memory, measured_, inverse_depth_, row_value_, row_slope_, free_depth_, links_,
             noise_counts_);
}

}  // namespace gpu
}  // namespace dtsdf
