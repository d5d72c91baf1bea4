#include "cpu/frame_surfels.h"

#include "mapper/fusion_view.h"

namespace dtsdf {
namespace {

float rawValue(const DepthFrame& frame, int u, int v) {
  const char* row = static_cast<const char*>(frame.data) + static_cast<size_t>(v) * frame.row_bytes;
  if (frame.encoding == DepthEncoding::kUint16) {
    return static_cast<float>(reinterpret_cast<const uint16_t*>(row)[u]);
  }
  return reinterpret_cast<const float*>(row)[u];
}

}  // namespace

size_t FrameSurfels::compute(const DepthFrame& frame, const FrameView& view,
                             const MapperParams& params, int threads) {
  const int width = view.width, height = view.height;
  const size_t pixels = static_cast<size_t>(width) * height;
  inverse_depth_.resize(pixels);
  row_value_.resize(pixels);
  row_slope_.resize(pixels);
  surfels_.resize(pixels);
  const NormalFitSettings settings = makeNormalFitSettings(params, view);
  size_t count = 0;

#pragma omp parallel num_threads(threads)
  {
#pragma omp for schedule(static)
    for (int v = 0; v < height; ++v) {
      float* row = &inverse_depth_[static_cast<size_t>(v) * width];
      for (int u = 0; u < width; ++u) {
        row[u] = inverseDepth(rawValue(frame, u, v), frame.unit_m, params.fusion.min_depth_m,
                              params.fusion.max_depth_m);
      }
      for (int u = 0; u < width; ++u) {
        const RowFit fit = fitRow(inverse_depth_.data(), width, u, v, settings);
        row_value_[static_cast<size_t>(v) * width + u] = fit.value;
        row_slope_[static_cast<size_t>(v) * width + u] = fit.slope;
      }
    }
#pragma omp for schedule(static) reduction(+ : count)
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        const size_t i = static_cast<size_t>(v) * width + u;
        surfels_[i] = computeSurfel(view, inverse_depth_.data(), row_value_.data(),
                                    row_slope_.data(), u, v, settings);
        count += surfels_[i].weight > 0.0f;
      }
    }
  }
  return count;
}

}  // namespace dtsdf
