#include "frame_surfels.h"

#include <algorithm>

#include "launch.h"
#include "mapper/fusion_view.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kMaxRadius = 16;  // of fusion/normal_radius_px
constexpr int kTileWidth = kThreads + 2 * kMaxRadius;

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

/// A block of threads fits a stretch of one row. The tile has a margin in which pixels outside the
/// image count as unmeasured, which ends a walk just as the image's border does.
__global__ void fitRowsKernel(DepthImage image, NormalFitSettings settings, float* inverse_depth,
                              float* row_value, float* row_slope) {
  __shared__ float tile[kTileWidth];
  const int first_u = blockIdx.x * blockDim.x, u = first_u + threadIdx.x;
  for (int v = blockIdx.y; v < image.height; v += gridDim.y) {
    for (int i = threadIdx.x; i < kTileWidth; i += blockDim.x) {
      const int tile_u = first_u + i - kMaxRadius;
      tile[i] = tile_u >= 0 && tile_u < image.width ? inverseDepthAt(image, tile_u, v) : 0.0f;
    }
    __syncthreads();
    if (u < image.width) {
      const int64_t at = static_cast<int64_t>(v) * image.width + u;
      const RowFit fit = fitRow(tile, kTileWidth, threadIdx.x + kMaxRadius, 0, settings);
      inverse_depth[at] = tile[threadIdx.x + kMaxRadius];
      row_value[at] = fit.value;
      row_slope[at] = fit.slope;
    }
    __syncthreads();
  }
}

/// Adds to `usable` where there are surfels with a weight; only whether it stays 0 has a meaning.
__global__ void computeSurfelsKernel(FrameView frame, NormalFitSettings settings,
                                     const float* inverse_depth, const float* row_value,
                                     const float* row_slope, Surfel* surfels, uint32_t* usable) {
  const int u = blockIdx.x * blockDim.x + threadIdx.x;
  int found = 0;
  for (int v = blockIdx.y; u < frame.width && v < frame.height; v += gridDim.y) {
    const Surfel surfel =
        computeSurfel(frame, inverse_depth, row_value, row_slope, u, v, settings);
    surfels[static_cast<int64_t>(v) * frame.width + u] = surfel;
    found |= surfel.weight > 0.0f;
  }
  const int found_here = __syncthreads_count(found);
  if (threadIdx.x == 0 && found_here > 0) atomicAdd(usable, static_cast<uint32_t>(found_here));
}

}  // namespace

void* FrameSurfels::stage(size_t bytes) {
  pinned_raw_.reserve(bytes);
  raw_bytes_ = bytes;
  return pinned_raw_.data();
}

void FrameSurfels::compute(const RawDepth& raw, const FrameView& view, const MapperParams& params,
                           uint32_t* usable, const Stream& stream) {
  const size_t pixels = static_cast<size_t>(view.width) * view.height;
  raw_.reserve(raw_bytes_, stream);
  inverse_depth_.reserve(pixels, stream);
  row_value_.reserve(pixels, stream);
  row_slope_.reserve(pixels, stream);
  surfels_.reserve(pixels, stream);
  raw_.upload(pinned_raw_.data(), raw_bytes_, stream);

  const DepthImage image{raw_.data(),  raw, view.width, view.height, params.fusion.min_depth_m,
                         params.fusion.max_depth_m};
  const NormalFitSettings settings = makeNormalFitSettings(params, view);
  constexpr int kMaxGridRows = 65535;
  const dim3 grid(blocksFor(view.width), std::min(view.height, kMaxGridRows));
  fitRowsKernel<<<grid, kThreads, 0, stream.get()>>>(image, settings, inverse_depth_.data(),
                                                     row_value_.data(), row_slope_.data());
  DTSDF_CHECK_LAUNCH("fitRowsKernel");
  computeSurfelsKernel<<<grid, kThreads, 0, stream.get()>>>(
      view, settings, inverse_depth_.data(), row_value_.data(), row_slope_.data(),
      surfels_.data(), usable);
  DTSDF_CHECK_LAUNCH("computeSurfelsKernel");
}

}  // namespace gpu
}  // namespace dtsdf
