#include "sense.h"

#include <cub/block/block_scan.cuh>

#include "backend/rule_settings.h"
#include "kernels/fusion/free_space.h"
#include "kernels/surfels/row_fit.h"
#include "launch.h"
#include "named_kernels.h"
#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kTileWidth = kThreads + 2 * kMaxNormalRadius_px;

struct DepthImage {
  RawDepth raw;
  int32_t width, height;
};

__device__ float inverseDepthAt(const DepthImage& image, int u, int v) {
  const int64_t i = static_cast<int64_t>(v) * image.width + u;
  const float value = image.raw.is_uint16
                          ? static_cast<float>(static_cast<const uint16_t*>(image.raw.data)[i])
                          : static_cast<const float*>(image.raw.data)[i];
  return inverseDepth(value, image.raw.range);
}

/// Counts a line of the frame, if it lies in the image, by the bin of its variance.
__device__ void countNoiseLine(const DepthImage& image, const SurfelSettings& surfels, int i,
                               uint32_t* bins) {
  const Pixel middle = noisePoint(i, image.width, image.height);
  if (!hasNoiseLine(middle, image.width)) return;
  float line[kNoiseLength];
  for (int k = 0; k < kNoiseLength; ++k) {
    line[k] = inverseDepthAt(image, middle.u + k - kNoiseRadius, middle.v);
  }
  const float variance = varianceAboutLine(line, surfels);
  if (variance >= 0.0f) atomicAdd(&bins[noiseBin(variance)], 1u);
}

/// Takes the median out of the counts and leaves them zeroed, with the threads of one block.
__device__ void takeMedian(NoiseCounts& counts, uint32_t least_lines, float* sigma) {
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
  if (lines < least_lines) {
    if (threadIdx.x == 0) *sigma = 0.0f;
    return;
  }
  const uint32_t rank = medianRank(lines);
  for (int k = 0; k < kBinsPerThread; before += in_bin[k++]) {
    if (before <= rank && rank < before + in_bin[k]) *sigma = noiseOfBin(first_bin + k);
  }
}

/// One thread per line; the block of threads that finishes last takes the median.
__global__ void __launch_bounds__(kThreads)
    estimateNoiseKernel(DepthImage image, SurfelSettings surfels, NoiseCounts* counts,
                        float* sigma) {
  __shared__ bool is_last;
  const size_t i = globalThread();
  if (i < kNoisePoints) countNoiseLine(image, surfels, static_cast<int>(i), counts->bins);
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) is_last = atomicAdd(&counts->finished, 1u) == gridDim.x - 1;
  __syncthreads();
  if (!is_last) return;
  __threadfence();
  takeMedian(*counts, static_cast<uint32_t>(surfels.rules.least_noise_lines), sigma);
}

/// The images that the row pass writes.
struct RowImages {
  float* inverse_depth;
  float* row_value;
  float* row_slope;
};

/// A block of threads fits a stretch of one row. The tile has a margin in which pixels outside the
/// image count as unmeasured, which ends a walk just as the image's border does.
__global__ void fitRowsKernel(DepthImage image, FrameView frame, SurfelSettings surfels,
                              const float* sigma, RowImages rows) {
  __shared__ float tile[kTileWidth];
  const FitWindow window = fitWindow(frame, *sigma, surfels);
  const int first_u = blockIdx.x * blockDim.x, u = first_u + threadIdx.x;
  for (int v = blockIdx.y; v < image.height; v += gridDim.y) {
    for (int i = threadIdx.x; i < kTileWidth; i += blockDim.x) {
      const int tile_u = first_u + i - kMaxNormalRadius_px;
      tile[i] = tile_u >= 0 && tile_u < image.width ? inverseDepthAt(image, tile_u, v) : 0.0f;
    }
    __syncthreads();
    if (u < image.width) {
      const int64_t at = static_cast<int64_t>(v) * image.width + u;
      const int in_tile = threadIdx.x + kMaxNormalRadius_px;
      const RowFit fit = fitRow(tile, kTileWidth, in_tile, window, surfels);
      rows.inverse_depth[at] = tile[in_tile];
      rows.row_value[at] = fit.value;
      rows.row_slope[at] = fit.slope;
    }
    __syncthreads();
  }
}

/// How far each pixel sees free space.
__global__ void findFreeDepthsKernel(DeviceSensing on_device, SurfelSettings surfels,
                                     FusionSettings fusion, float* free_depth) {
  const FrameSensing sensing = on_device.load();
  const FrameView& frame = sensing.image.frame;
  const int u = blockIdx.x * blockDim.x + threadIdx.x;
  for (int v = blockIdx.y; u < frame.width && v < frame.height; v += gridDim.y) {
    free_depth[pixelIndex(frame, {u, v})] = freeDepth(sensing, {u, v}, surfels, fusion);
  }
}

}  // namespace

FrameSensor::FrameSensor(const MapperParams& params, const Rules& rules, const Stream& stream)
    : clears_(clearsFreeSpace(params)),
      surfel_settings_(makeSurfelSettings(params, rules.surfels)),
      fusion_settings_(makeFusionSettings(params, rules.fusion)),
      stream_(stream),
      sigma_(1),
      noise_counts_(1) {
  noise_counts_.zero(stream);
}

void FrameSensor::reserve(size_t pixels) {
  inverse_depth_.reserveExactly(pixels, stream_);
  row_value_.reserveExactly(pixels, stream_);
  row_slope_.reserveExactly(pixels, stream_);
  free_depth_.reserveExactly(pixels, stream_);
}

DeviceSensing FrameSensor::sense(const FrameView& frame, const RawDepth& raw) {
  reserve(static_cast<size_t>(frame.width) * frame.height);
  const DepthImage depth{raw, frame.width, frame.height};
  const StageSpan span(stream_, Stage::kSense);
  estimateNoiseKernel<<<blocksFor(kNoisePoints), kThreads, 0, stream_.get()>>>(
      depth, surfel_settings_, noise_counts_.data(), sigma_.data());
  DTSDF_CHECK_LAUNCH("estimateNoiseKernel");
  fitRowsKernel<<<rowGrid(frame), kThreads, 0, stream_.get()>>>(
      depth, frame, surfel_settings_, sigma_.data(),
      {inverse_depth_.data(), row_value_.data(), row_slope_.data()});
  DTSDF_CHECK_LAUNCH("fitRowsKernel");
  const ImageView image{frame, inverse_depth_.data(), row_value_.data(), row_slope_.data()};
  if (!clears_) return {image, sigma_.data(), nullptr};
  const DeviceSensing sensing(image, sigma_.data(), free_depth_.data());
  findFreeDepthsKernel<<<rowGrid(frame), kThreads, 0, stream_.get()>>>(
      sensing, surfel_settings_, fusion_settings_, free_depth_.data());
  DTSDF_CHECK_LAUNCH("findFreeDepthsKernel");
  return sensing;
}

void FrameSensor::addMemory(std::vector<MemoryPart>& parts) const {
  const size_t bytes = inverse_depth_.bytes() + row_value_.bytes() + row_slope_.bytes() +
                       free_depth_.bytes() + noise_counts_.bytes();
  parts.push_back({"images", MemoryKind::kScratch, bytes, bytes});
}

std::vector<NamedKernel> senseKernels() {
  return {DTSDF_NAMED_KERNEL(estimateNoiseKernel, 0), DTSDF_NAMED_KERNEL(fitRowsKernel, 0),
          DTSDF_NAMED_KERNEL(findFreeDepthsKernel, 0)};
}

}  // namespace gpu
}  // namespace dtsdf
