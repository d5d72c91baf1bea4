#include "cpu/sense.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "cpu/stretch_fit.h"
#include "cpu/widest_vectors.h"
#include "kernels/fusion/free_space.h"
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
void linkRow(const FrameView& frame, const float* inverse_depth, int v, const PixelSpan& span,
             const LinkLimits& limits, PixelLinks* links) {
  const float* row = inverse_depth + pixelIndex(frame, {0, v});
  const int last = std::min(span.end, frame.width - 1);
  std::fill(links, links + frame.width, PixelLinks{0});
  StretchSteps right{}, down{};
  for (int first = span.begin; first < last; first += kStretch) {
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
  if (span.end == frame.width) links[last] = linksOf(frame, inverse_depth, {last, v}, limits);
}

/// Which pixels of a row are empty between two that are not, in the row itself, up and down or
/// along a diagonal. Returns whether there are any.
bool findGaps(const float* __restrict__ above, const float* __restrict__ own,
              const float* __restrict__ below, int width, uint8_t* __restrict__ gaps) {
  const auto is_gap = [&](int u, int left, int right) {
    const int in_row = static_cast<int>(own[left] != 0.0f) & static_cast<int>(own[right] != 0.0f);
    const int in_column = static_cast<int>(above[u] != 0.0f) & static_cast<int>(below[u] != 0.0f);
    const int falling =
        static_cast<int>(above[left] != 0.0f) & static_cast<int>(below[right] != 0.0f);
    const int rising =
        static_cast<int>(below[left] != 0.0f) & static_cast<int>(above[right] != 0.0f);
    return static_cast<int>(own[u] == 0.0f) & (in_row | in_column | falling | rising);
  };
  const int last = width - 1;
  int any = 0;
  for (int u = 1; u < last; ++u) {
    const int gap = is_gap(u, u - 1, u + 1);
    gaps[u] = static_cast<uint8_t>(gap);
    any |= gap;
  }
  for (const int u : {0, last}) {  // up and down alone
    gaps[u] = static_cast<uint8_t>(is_gap(u, u, u));
    any |= gaps[u];
  }
  return any != 0;
}

void findFreeDepthsOfRow(const FrameSensing& of_frame, int v, const PixelSpan& span,
                         const FusionSettings& settings, float* __restrict__ free_depth) {
  const FrameSensing sensing = of_frame;  // copies of their own, which no result can overlap
  const FusionSettings fusion = settings;
  for (int u = span.begin; u < span.end; ++u) {
    free_depth[u] = freeDepth(sensing, {u, v}, fusion);
  }
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
  fillGaps(view, depthRangeOf(frame, params_), noise);
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
  measured_.resize(static_cast<size_t>(width) * frame.height);
  const DepthRange range = depthRangeOf(frame, params_);
  parallelFor<NoScratch>(frame.height, threads_, [&](size_t v, NoScratch&) {
    const char* row = static_cast<const char*>(frame.data) + v * frame.row_bytes;
    const bool is_whole = frame.encoding == DepthEncoding::kUint16;
    float* const inverse = &measured_[v * width];
    withWidestVectors([&] {
      if (is_whole) {
        invertRow<uint16_t>(row, width, range, inverse);
      } else {
        invertRow<float>(row, width, range, inverse);
      }
    });
  });
}

DepthNoise FrameSensor::estimateNoise(const FrameView& view) const {
  NoiseOfLines kinds[kNoiseKinds];
  parallelFor<NoScratch>(kNoiseKinds, threads_, [&](size_t kind, NoScratch&) {
    kinds[kind] = noiseOfLines(view, static_cast<int>(kind));
  });
  return {combinedNoise(kinds, surfel_settings_.rules), surfel_settings_.noise_in_depth};
}

NoiseOfLines FrameSensor::noiseOfLines(const FrameView& view, int kind) const {
  std::array<uint32_t, kNoiseBins> bins{};
  const auto measured = [&](int u, int v) {
    return measured_[static_cast<size_t>(v) * view.width + u];
  };
  uint32_t lines = 0;
  for (int i = 0; i < kNoisePoints; ++i) {
    const NoiseLinePlace place = noiseLinePlace(i, kind / 2, view.width, view.height);
    if (place.kind != kind) continue;
    const NoiseLine line = noiseLine(measured, view.width, view.height, place);
    const float variance = noiseVariance(line, surfel_settings_);
    if (variance < 0.0f) continue;
    ++bins[noiseBin(variance)];
    ++lines;
  }
  NoiseOfLines noise{};
  noise.lines = lines;
  if (lines == 0) return noise;
  uint32_t up_to = bins[0];  // lines
  int bin = 0;
  for (int quartile = 0; quartile < kNoiseQuartiles; ++quartile) {
    while (up_to <= quartileRank(lines, quartile)) up_to += bins[++bin];
    noise.quartiles[quartile] = noiseOfBin(bin, quartile);
  }
  return noise;
}

/// By filledInverseDepth() only where pixels are empty between two that are not.
void FrameSensor::fillGaps(const FrameView& view, const DepthRange& range,
                           const DepthNoise& noise) {
  const int width = view.width, height = view.height;
  inverse_depth_.resize(measured_.size());
  spans_.resize(height);
  const GapLimits limits = gapLimits(surfel_settings_, range, noise);
  const auto measured = [&](int u, int v) { return measured_[static_cast<size_t>(v) * width + u]; };
  struct GapRow {
    std::vector<uint8_t> is_gap;
    std::vector<float> nothing;  // above the first row, and below the last one
  };
  parallelFor<GapRow>(height, threads_, [&](size_t v, GapRow& row) {
    row.is_gap.resize(width);
    row.nothing.resize(width);
    const float* const own = &measured_[v * width];
    const float* const above = v == 0 ? row.nothing.data() : own - width;
    const float* const below =
        v + 1 == static_cast<size_t>(height) ? row.nothing.data() : own + width;
    float* const filled = &inverse_depth_[v * width];
    std::copy_n(own, width, filled);
    bool has_gaps = false;
    withWidestVectors([&] { has_gaps = findGaps(above, own, below, width, row.is_gap.data()); });
    for (int u = 0; has_gaps && u < width; ++u) {
      if (row.is_gap[u] == 0) continue;
      filled[u] = filledInverseDepth(measured, width, height, {u, static_cast<int>(v)}, limits);
    }
    spans_[v] = measuredSpan(filled, width);
  });
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
      linkRow(view, inverse_depth_.data(), static_cast<int>(v), spans_[v], limits,
              &links_[v * width]);
    });
    std::fill_n(&row_value_[v * width], width, 0.0f);
    std::fill_n(&row_slope_[v * width], width, 0.0f);
    if (spans_[v].begin == spans_[v].end) return;
    padded.values.assign(width + 2 * margin, 0.0f);
    padded.links.assign(width + 2 * margin, 0);
    std::copy_n(&inverse_depth_[v * width], width, padded.values.data() + margin);
    std::copy_n(&links_[v * width], width, padded.links.data() + margin);
    StretchFit fits;
    for (int first = spans_[v].begin; first < spans_[v].end; first += kStretch) {
      const int count = std::min(kStretch, spans_[v].end - first);
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

void FrameSensor::findFreeDepths(const FrameSensing& sensing) {
  const FrameView& view = sensing.image.frame;
  free_depth_.resize(inverse_depth_.size());
  parallelFor<NoScratch>(view.height, threads_, [&](size_t row, NoScratch&) {
    std::fill_n(&free_depth_[row * view.width], view.width, 0.0f);
    withWidestVectors([&] {
      findFreeDepthsOfRow(sensing, static_cast<int>(row), spans_[row], fusion_settings_,
                          &free_depth_[row * view.width]);
    });
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
                        measured_.capacity() + free_depth_.capacity() + most_free_.capacity();
  return floats * sizeof(float) + links_.capacity() * sizeof(PixelLinks);
}

}  // namespace dtsdf
