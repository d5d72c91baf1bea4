#include "cpu/sense.h"

#include <algorithm>
#include <array>

#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "cpu/parallel_for.h"
#include "cpu/stretch_fit.h"
#include "kernels/fusion/free_space.h"
#include "kernels/surfels/noise.h"

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

FrameSensor::FrameSensor(const MapperParams& params, const Rules& rules, int threads)
    : params_(params),
      surfel_settings_(makeSurfelSettings(params, rules.surfels)),
      fusion_settings_(makeFusionSettings(params, rules.fusion)),
      threads_(threads) {}

FrameSensing FrameSensor::sense(const DepthFrame& frame) {
  const FrameView view = makeFrameView(frame, params_.map.voxel_size_m);
  const float sigma = estimateNoise(frame);
  fitRows(frame, view, sigma);
  const ImageView image{view, inverse_depth_.data(), row_value_.data(), row_slope_.data()};
  FrameSensing sensing{image, sigma, nullptr};
  if (clearsFreeSpace(params_)) {
    findFreeDepths(sensing);
    sensing.free_depth = free_depth_.data();
  }
  return sensing;
}

/// Standard deviation of a frame's inverse depth, in 1/m.
float FrameSensor::estimateNoise(const DepthFrame& frame) const {
  const DepthRange range = depthRangeOf(frame, params_);
  std::array<uint32_t, kNoiseBins> bins{};
  int lines = 0;
  for (int i = 0; i < kNoisePoints; ++i) {
    const Pixel middle = noisePoint(i, frame.width, frame.height);
    if (!hasNoiseLine(middle, frame.width)) continue;
    float line[kNoiseLength];
    for (int k = 0; k < kNoiseLength; ++k) {
      line[k] = inverseDepth(rawValue(frame, middle.u + k - kNoiseRadius, middle.v), range);
    }
    const float variance = varianceAboutLine(line, surfel_settings_);
    if (variance < 0.0f) continue;
    ++bins[noiseBin(variance)];
    ++lines;
  }
  if (lines < surfel_settings_.rules.least_noise_lines) return 0.0f;
  uint32_t below = 0;
  int bin = 0;
  while ((below += bins[bin]) <= medianRank(lines)) ++bin;
  return noiseOfBin(bin);
}

void FrameSensor::fitRows(const DepthFrame& frame, const FrameView& view, float sigma) {
  const int width = view.width;
  const size_t pixels = static_cast<size_t>(width) * view.height;
  inverse_depth_.resize(pixels);
  row_value_.resize(pixels);
  row_slope_.resize(pixels);
  const DepthRange range = depthRangeOf(frame, params_);
  const FitWindow window = fitWindow(view, sigma, surfel_settings_);
  const int margin = surfel_settings_.normal_radius_px;
  // In the margin pixels count as unmeasured, which ends a walk just as the image's border does.
  using PaddedRow = std::vector<float>;
  parallelFor<PaddedRow>(view.height, threads_, [&](size_t v, PaddedRow& row) {
    row.assign(width + 2 * margin, 0.0f);
    float* values = row.data() + margin;
    for (int u = 0; u < width; ++u) {
      values[u] = inverseDepth(rawValue(frame, u, static_cast<int>(v)), range);
    }
    std::copy(values, values + width, &inverse_depth_[v * width]);
    StretchFit fits;
    for (int first = 0; first < width; first += kStretch) {
      const int count = std::min(kStretch, width - first);
      const float* centres = values + first;
      fits.compute({count, centres, centres}, {1, margin, margin}, window, surfel_settings_);
      for (int i = 0; i < count; ++i) {
        const RowFit fit = rowFitOf(fits.fit(i));
        row_value_[v * width + first + i] = fit.value;
        row_slope_[v * width + first + i] = fit.slope;
      }
    }
  });
}

void FrameSensor::findFreeDepths(const FrameSensing& sensing) {
  const FrameView& view = sensing.image.frame;
  free_depth_.resize(inverse_depth_.size());
  struct NoScratch {};
  parallelFor<NoScratch>(view.height, threads_, [&](size_t row, NoScratch&) {
    for (int u = 0; u < view.width; ++u) {
      free_depth_[row * view.width + u] =
          freeDepth(sensing, {u, static_cast<int32_t>(row)}, surfel_settings_, fusion_settings_);
    }
  });
}

size_t FrameSensor::bytes() const {
  return (inverse_depth_.capacity() + row_value_.capacity() + row_slope_.capacity() +
          free_depth_.capacity()) * sizeof(float);
}

}  // namespace dtsdf
