#include "cpu/sense.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "cpu/stretch_fit.h"
#include "cpu/widest_vectors.h"
#include "kernels/fusion/free_space.h"
#include "kernels/surfels/noise.h"
#include "threads/parallel_for.h"

namespace dtsdf {
namespace {

template <class Raw>
void invertRow(const void* __restrict__ row, int width, const DepthRange& depth_range,
               float* __restrict__ inverse_depth) {
  const auto* const bytes = static_cast<const char*>(row);  // rows may begin at any byte
  const DepthRange range = depth_range;  // a copy of its own, which no result can overlap
  for (int u = 0; u < width; ++u) {
    Raw raw;
    std::memcpy(&raw, bytes + u * sizeof(Raw), sizeof(Raw));
    inverse_depth[u] = inverseDepth(static_cast<float>(raw), range);
  }
}

/// What the steps of neighbouring pixels to the next ones tell.
struct StretchSteps {
  int32_t link[kStretch];

  void compute(const float* pixels, int64_t stride, int count, const LinkLimits& limits) {
    for (int i = 0; i < count; ++i) link[i] = linkByStep(pixels[i], pixels[i + stride], limits);
  }
};

/// The links of a row, by linksOf() only where the steps alone do not tell.
void linkRow(const FrameView& frame, const float* inverse_depth, int v, const PixelSpan& told,
             const LinkLimits& limits, PixelLinks* links) {
  const float* row = inverse_depth + pixelIndex(frame, {0, v});
  const int last = std::min(told.end, frame.width - 1);
  std::fill(links, links + frame.width, PixelLinks{0});
  StretchSteps right{}, down{};
  for (int first = told.begin; first < last; first += kStretch) {
    const int count = std::min(kStretch, last - first);
    right.compute(row + first, 1, count, limits);
    if (v + 1 < frame.height) down.compute(row + first, frame.width, count, limits);
    int32_t steps = 0;
    for (int i = 0; i < count; ++i) {
      steps |= right.link[i] | down.link[i];
      links[first + i] = static_cast<PixelLinks>((right.link[i] & kLinked) * kLinkRight |
                                                 (down.link[i] & kLinked) * kLinkDown);
    }
    if (!(steps & kOpenStep)) continue;
    for (int i = 0; i < count; ++i) {
      if (!((right.link[i] | down.link[i]) & kOpenStep)) continue;
      links[first + i] = linksOf(frame, inverse_depth, {first + i, v}, limits);
    }
  }
  if (told.end == frame.width) links[last] = linksOf(frame, inverse_depth, {last, v}, limits);
}

void findFreeIfMeasured(const FrameSensing& of_frame, int v, const PixelSpan& told,
                        const FusionSettings& settings, float* __restrict__ free_if_measured) {
  const FrameSensing sensing = of_frame;  // copies of their own, which no result can overlap
  const FusionSettings fusion = settings;
  for (int u = told.begin; u < told.end; ++u) {
    free_if_measured[u] = freeIfMeasured(sensing, {u, v}, fusion);
  }
}

/// Free depths of a row that has one above and one below; `told` is of all three.
void fillGaps(const float* __restrict__ inverse_depth, const float* __restrict__ free_if_measured,
              int width, const PixelSpan& told, float* __restrict__ free_depth) {
  const int last = width - 1, end = std::min(told.end + 1, last);
  free_depth[0] = free_if_measured[0];
  for (int u = std::max(told.begin - 1, 1); u < end; ++u) {
    const float in_gap = freeInGap([&](int du, int dv) {
      return free_if_measured[u + du + static_cast<int64_t>(dv) * width];
    });
    const float own = free_if_measured[u];
    free_depth[u] = inverse_depth[u] != 0.0f ? own : in_gap;
  }
  free_depth[last] = free_if_measured[last];
}

/// The greatest values of squares of a grid that lie side by side, from row `first_v` on.
void findGreatest(const DepthGrid& grid, int first_v, int side, std::vector<float>& columns,
                  float* tiles) {
  columns.assign(grid.values + static_cast<size_t>(first_v) * grid.width,
                 grid.values + static_cast<size_t>(first_v + 1) * grid.width);
  withWidestVectors([&, greatest = columns.data()] {
    for (int v = first_v + 1; v < std::min(first_v + side, grid.height); ++v) {
      const float* row = grid.values + static_cast<size_t>(v) * grid.width;
      for (int u = 0; u < grid.width; ++u) greatest[u] = maximum(greatest[u], row[u]);
    }
  });
  for (int u = 0; u < grid.width; u += side) {
    *tiles++ = greatestIn({columns.data(), grid.width, 1}, u, 0, side);
  }
}

struct NoScratch {};

}  // namespace

FrameSensor::FrameSensor(const MapperParams& params, const Rules& rules, int threads)
    : params_(params),
      surfel_settings_(makeSurfelSettings(params, rules.surfels)),
      fusion_settings_(makeFusionSettings(params, rules)),
      threads_(threads) {}

FrameSensing FrameSensor::sense(const DepthFrame& frame) {
  const FrameView view = makeFrameView(frame, params_.map.voxel_size_m);
  invertDepths(frame);
  const DepthNoise noise = estimateNoise(view);
  linkAndFitRows(view, noise);
  const ImageView image{view, inverse_depth_.data(), row_value_.data(), row_slope_.data(),
                        links_.data()};
  FrameSensing sensing{image, noise, nullptr, nullptr};
  if (needsFreeDepth(params_)) {
    findFreeDepths(sensing);
    findMostFree(view);
    sensing.free_depth = free_depth_.data();
    sensing.most_free = most_free_.data();
  }
  return sensing;
}

void FrameSensor::invertDepths(const DepthFrame& frame) {
  const int width = frame.width;
  inverse_depth_.resize(static_cast<size_t>(width) * frame.height);
  told_.resize(frame.height);
  const DepthRange range = depthRangeOf(frame, params_);
  parallelFor<NoScratch>(frame.height, threads_, [&](size_t v, NoScratch&) {
    const char* row = static_cast<const char*>(frame.data) + v * frame.row_bytes;
    const bool is_whole = frame.encoding == DepthEncoding::kUint16;
    float* const inverse = &inverse_depth_[v * width];
    withWidestVectors([&] {
      if (is_whole) {
        invertRow<uint16_t>(row, width, range, inverse);
      } else {
        invertRow<float>(row, width, range, inverse);
      }
    });
    told_[v] = toldSpan(inverse, width);
  });
}

DepthNoise FrameSensor::estimateNoise(const FrameView& view) const {
  float sigma[kNoiseKinds];
  parallelFor<NoScratch>(kNoiseKinds, threads_, [&](size_t kind, NoScratch&) {
    sigma[kind] = medianNoise(view, static_cast<int>(kind));
  });
  return {combinedNoise(sigma, surfel_settings_.rules), surfel_settings_.noise_in_depth};
}

/// Standard deviation at 1 m about one kind of line; 0 where there is none.
float FrameSensor::medianNoise(const FrameView& view, int kind) const {
  std::array<uint32_t, kNoiseBins> bins{};
  const auto inverse_depth_at = [&](int u, int v) {
    return inverse_depth_[static_cast<size_t>(v) * view.width + u];
  };
  int lines = 0;
  for (int i = 0; i < kNoisePoints; ++i) {
    const Pixel middle = noisePoint(i, view.width, view.height);
    if (!(inverse_depth_at(middle.u, middle.v) > 0.0f)) continue;  // nor is there a line
    const NoiseLine line = noiseLine(inverse_depth_at, view.width, view.height, middle, kind);
    const float variance = noiseVariance(line, kind, surfel_settings_);
    if (variance < 0.0f) continue;
    ++bins[noiseBin(variance)];
    ++lines;
  }
  if (lines == 0) return 0.0f;
  uint32_t below = 0;
  int bin = 0;
  while ((below += bins[bin]) <= medianRank(lines)) ++bin;
  return noiseOfBin(bin);
}

/// Both in one loop over the rows: the fit of a row needs none but its own links.
void FrameSensor::linkAndFitRows(const FrameView& view, const DepthNoise& noise) {
  const int width = view.width;
  links_.resize(inverse_depth_.size());
  const LinkLimits limits = linkLimits(view, noise, surfel_settings_);
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
    withWidestVectors([&] {
      linkRow(view, inverse_depth_.data(), static_cast<int>(v), told_[v], limits,
              &links_[v * width]);
    });
    std::fill_n(&row_value_[v * width], width, 0.0f);
    std::fill_n(&row_slope_[v * width], width, 0.0f);
    if (told_[v].begin == told_[v].end) return;
    padded.values.assign(width + 2 * margin, 0.0f);
    padded.links.assign(width + 2 * margin, 0);
    std::copy_n(&inverse_depth_[v * width], width, padded.values.data() + margin);
    std::copy_n(&links_[v * width], width, padded.links.data() + margin);
    StretchFit fits;
    for (int first = told_[v].begin; first < told_[v].end; first += kStretch) {
      const int count = std::min(kStretch, told_[v].end - first);
      const float* centres = padded.values.data() + margin + first;
      fits.compute({count, {centres, centres, padded.links.data() + margin + first}},
                   {1, kLinkRight, margin, margin, margin}, window);
      for (int i = 0; i < count; ++i) {
        const RowFit fit = rowFitOf(fits.fit(i));
        row_value_[v * width + first + i] = fit.value;
        row_slope_[v * width + first + i] = fit.slope;
      }
    }
  });
}

/// freeDepth() of all pixels, measured ones first: the others look at those beside them.
void FrameSensor::findFreeDepths(const FrameSensing& sensing) {
  const FrameView& view = sensing.image.frame;
  free_if_measured_.resize(inverse_depth_.size());
  free_depth_.resize(inverse_depth_.size());
  parallelFor<NoScratch>(view.height, threads_, [&](size_t row, NoScratch&) {
    std::fill_n(&free_if_measured_[row * view.width], view.width, 0.0f);
    withWidestVectors([&] {
      findFreeIfMeasured(sensing, static_cast<int>(row), told_[row], fusion_settings_,
                         &free_if_measured_[row * view.width]);
    });
  });
  parallelFor<NoScratch>(view.height, threads_, [&](size_t row, NoScratch&) {
    const size_t first = row * view.width;
    const bool is_inside = row > 0 && row + 1 < static_cast<size_t>(view.height);
    if (is_inside) {
      const PixelSpan told = unite(told_[row], unite(told_[row - 1], told_[row + 1]));
      std::fill_n(&free_depth_[first], view.width, 0.0f);
      if (told.begin == told.end) return;
      withWidestVectors([&] {
        fillGaps(&inverse_depth_[first], &free_if_measured_[first], view.width, told,
                 &free_depth_[first]);
      });
    } else {
      std::copy_n(&free_if_measured_[first], view.width, &free_depth_[first]);
    }
  });
}

/// Of fine tiles, then of coarse ones.
void FrameSensor::findMostFree(const FrameView& view) {
  const auto fine_count = static_cast<size_t>(tileCount(view, kFineTileLog2));
  most_free_.resize(fine_count + static_cast<size_t>(tileCount(view, kCoarseTileLog2)));
  const auto fill = [&](const DepthGrid& grid, int log2, float* tiles) {
    parallelFor<std::vector<float>>(
        tilesAlong(grid.height, log2), threads_, [&](size_t v, std::vector<float>& columns) {
          findGreatest(grid, static_cast<int>(v) << log2, 1 << log2, columns,
                       tiles + v * tilesAlong(grid.width, log2));
        });
  };
  fill({free_depth_.data(), view.width, view.height}, kFineTileLog2, most_free_.data());
  fill({most_free_.data(), tilesAlong(view.width, kFineTileLog2),
        tilesAlong(view.height, kFineTileLog2)},
       kCoarseTileLog2 - kFineTileLog2, most_free_.data() + fine_count);
}

size_t FrameSensor::bytes() const {
  const size_t floats = inverse_depth_.capacity() + row_value_.capacity() + row_slope_.capacity() +
                        free_if_measured_.capacity() + free_depth_.capacity() +
                        most_free_.capacity();
  return floats * sizeof(float) + links_.capacity() * sizeof(PixelLinks);
}

}  // namespace dtsdf
