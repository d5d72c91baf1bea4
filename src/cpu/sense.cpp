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

struct NoScratch {};

}  // namespace

FrameSensor::FrameSensor(const MapperParams& params, const Rules& rules, int threads)
    : params_(params),
      surfel_settings_(makeSurfelSettings(params, rules.surfels)),
      fusion_settings_(makeFusionSettings(params, rules.fusion)),
      threads_(threads) {}

FrameSensing FrameSensor::sense(const DepthFrame& frame) {
  const FrameView view = makeFrameView(frame, params_.map.voxel_size_m);
  invertDepths(frame);
  const DepthNoise noise = estimateNoise(view);
  findLinks(view, noise);
  fitRows(view, noise);
  const ImageView image{view, inverse_depth_.data(), row_value_.data(), row_slope_.data(),
                        links_.data()};
  FrameSensing sensing{image, noise, nullptr};
  if (clearsFreeSpace(params_)) {
    findFreeDepths(sensing);
    sensing.free_depth = free_depth_.data();
  }
  return sensing;
}

void FrameSensor::invertDepths(const DepthFrame& frame) {
  const int width = frame.width;
  inverse_depth_.resize(static_cast<size_t>(width) * frame.height);
  const DepthRange range = depthRangeOf(frame, params_);
  parallelFor<NoScratch>(frame.height, threads_, [&](size_t v, NoScratch&) {
    for (int u = 0; u < width; ++u) {
      inverse_depth_[v * width + u] =
          inverseDepth(rawDepth(frame, u, static_cast<int>(v)), range);
    }
  });
}

DepthNoise FrameSensor::estimateNoise(const FrameView& view) const {
  float sigma[kNoiseKinds];
  for (int kind = 0; kind < kNoiseKinds; ++kind) sigma[kind] = medianNoise(view, kind);
  return {combinedNoise(sigma, surfel_settings_.rules), surfel_settings_.noise_in_depth};
}

/// Standard deviation at 1 m about one kind of line; 0 where there are too few to tell.
float FrameSensor::medianNoise(const FrameView& view, int kind) const {
  std::array<uint32_t, kNoiseBins> bins{};
  int lines = 0;
  for (int i = 0; i < kNoisePoints; ++i) {
    const Pixel middle = noisePoint(i, view.width, view.height);
    const NoiseLine line = noiseLine(inverse_depth_.data(), view.width, view.height, middle, kind);
    const float variance = noiseVariance(line, kind, surfel_settings_);
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

void FrameSensor::findLinks(const FrameView& view, const DepthNoise& noise) {
  links_.resize(inverse_depth_.size());
  const LinkLimits limits = linkLimits(view, noise, surfel_settings_);
  parallelFor<NoScratch>(view.height, threads_, [&](size_t row, NoScratch&) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < view.width; ++u) {
      links_[row * view.width + u] = linksOf(view, inverse_depth_.data(), {u, v}, limits);
    }
  });
}

void FrameSensor::fitRows(const FrameView& view, const DepthNoise& noise) {
  const int width = view.width;
  row_value_.resize(inverse_depth_.size());
  row_slope_.resize(inverse_depth_.size());
  const FitWindow window = fitWindow(view, noise, surfel_settings_);
  const int margin = surfel_settings_.normal_radius_px;
  // In the margin pixels count as unmeasured, which ends a walk just as the image's border does.
  struct PaddedRow {
    std::vector<float> values;
    std::vector<PixelLinks> links;
  };
  parallelFor<PaddedRow>(view.height, threads_, [&](size_t v, PaddedRow& padded) {
    padded.values.assign(width + 2 * margin, 0.0f);
    padded.links.assign(width + 2 * margin, 0);
    std::copy_n(&inverse_depth_[v * width], width, padded.values.data() + margin);
    std::copy_n(&links_[v * width], width, padded.links.data() + margin);
    StretchFit fits;
    for (int first = 0; first < width; first += kStretch) {
      const int count = std::min(kStretch, width - first);
      const float* centres = padded.values.data() + margin + first;
      fits.compute({count, {centres, centres, padded.links.data() + margin + first}},
                   {1, kLinkRight, margin, margin}, window);
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
  parallelFor<NoScratch>(view.height, threads_, [&](size_t row, NoScratch&) {
    for (int u = 0; u < view.width; ++u) {
      free_depth_[row * view.width + u] =
          freeDepth(sensing, {u, static_cast<int32_t>(row)}, fusion_settings_);
    }
  });
}

size_t FrameSensor::bytes() const {
  return (inverse_depth_.capacity() + row_value_.capacity() + row_slope_.capacity() +
          free_depth_.capacity()) * sizeof(float) + links_.capacity() * sizeof(PixelLinks);
}

}  // namespace dtsdf
