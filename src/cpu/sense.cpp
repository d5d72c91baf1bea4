#include "cpu/sense.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "cpu/stretch_fit.h"
#include "cpu/widest_vectors.h"
#include "kernels/fusion/free_space.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

template <class Raw>
void invertRow(const void* __restrict__ row, const PixelSpan& span, const DepthRange& depth_range,
               float* __restrict__ inverse_depth) {
  const auto* const bytes = static_cast<const char*>(row);  // rows may begin at any byte
  const DepthRange range = depth_range;  // a copy of its own, which no result can overlap
  for (int u = span.begin; u < span.end; ++u) {
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

/// Which pixels in a span of a row are empty between two that are not, in the row itself, up and
/// down or along a diagonal. Returns whether there are any.
bool findGaps(const float* __restrict__ above, const float* __restrict__ own,
              const float* __restrict__ below, int width, const PixelSpan& span,
              uint8_t* __restrict__ gaps) {
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
  const int first = std::max(span.begin, 1), end = std::min(span.end, last);
  int any = 0;
  for (int u = first; u < end; ++u) {
    const int gap = is_gap(u, u - 1, u + 1);
    gaps[u] = static_cast<uint8_t>(gap);
    any |= gap;
  }
  for (const int u : {0, last}) {  // up and down alone
    if (u < span.begin || u >= span.end) continue;
    gaps[u] = static_cast<uint8_t>(is_gap(u, u, u));
    any |= gaps[u];
  }
  return any != 0;
}

void findFreeDepthsOfRow(const FrameSensing& of_frame, int v, const PixelSpan& span,
                         const FusionSettings& settings, float* __restrict__ free_depth) {
  const FrameSensing sensing = of_frame;  // copies of their own, which no result can overlap
  const FusionSettings fusion = settings;
  const ImageView& image = sensing.image;
  const int64_t first = pixelIndex(image.frame, {0, v}), width = image.frame.width;
  const bool has_above = v > 0, has_below = v < image.frame.height - 1;
  const float* const value = image.row_value + first;
  const PixelLinks* const links = image.links + first;
  const float* const above = has_above ? value - width : value;  // which counts for nothing
  const float* const below = has_below ? value + width : value;
  const PixelLinks* const links_above = has_above ? links - width : links;
  const float takes_above = has_above ? 1.0f : 0.0f, takes_below = has_below ? 1.0f : 0.0f;
  for (int u = span.begin; u < span.end; ++u) {
    const PlaneAround plane{image.inverse_depth[first + u],
                            value[u],
                            image.row_slope[first + u],
                            takes_above * above[u],
                            takes_below * below[u],
                            links[u],
                            links_above[u]};
    free_depth[u] = freeDepth(sensing, {u, v}, plane, fusion);
  }
}

/// The greatest values of squares of a grid that lie side by side, from row `first_v` on, which
/// are 0 but for a span.
void findGreatest(const DepthGrid& grid, int first_v, int side, const PixelSpan& span,
                  std::vector<float>& columns, float* patches) {
  static_assert(kSpanStep % (1 << kFinePatchLog2) == 0, "spans are of whole squares");
  std::fill_n(patches, (grid.width + side - 1) / side, 0.0f);
  if (span.isEmpty()) return;
  columns.assign(grid.width, 0.0f);
  withWidestVectors([&, greatest = columns.data()] {
    for (int v = first_v; v < std::min(first_v + side, grid.height); ++v) {
      const float* row = grid.values + static_cast<size_t>(v) * grid.width;
      for (int u = span.begin; u < span.end; ++u) greatest[u] = maximum(greatest[u], row[u]);
    }
  });
  for (int u = span.begin; u < span.end; u += side) {
    patches[u / side] = greatestIn({columns.data(), grid.width, 1}, u, 0, side);
  }
}

/// How often each variance of noise comes up.
struct NoiseBins {
  std::array<uint32_t, kNoiseBins> count{};
  uint32_t lines = 0;

  void add(float variance) {
    ++count[noiseBin(variance)];
    ++lines;
  }

  /// @pre there are lines.
  NoiseOfLines noise() const {
    NoiseOfLines noise{};
    noise.lines = lines;
    uint32_t up_to = count[0];  // lines
    int bin = 0;
    for (int quartile = 0; quartile < kNoiseQuartiles; ++quartile) {
      while (up_to <= quartileRank(lines, quartile)) up_to += count[++bin];
      noise.quartiles[quartile] = noiseOfBin(bin, quartile);
    }
    return noise;
  }
};

constexpr size_t kRowsAtATime = 8;  ///< That a thread takes.

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
    sensing.free_depth = free_depth_.data();
    sensing.most_free = most_free_.data();
  }
  return sensing;
}

/// Where the raw values are 0, nothing is measured.
void FrameSensor::invertDepths(const DepthFrame& frame) {
  const int width = frame.width;
  measured_.resize(width, frame.height);
  const DepthRange range = depthRangeOf(frame, params_);
  const bool is_whole = frame.encoding == DepthEncoding::kUint16;
  parallelFor<kRowsAtATime>(frame.height, threads_, [&](size_t v) {
    const char* row = static_cast<const char*>(frame.data) + v * frame.row_bytes;
    const PixelSpan whole{0, width};
    const PixelSpan span = is_whole ? measuredSpan<uint16_t>(row, width, whole)
                                    : measuredSpan<float>(row, width, whole);
    float* const inverse = measured_.newRow(v, span);
    withWidestVectors([&] {
      if (is_whole) {
        invertRow<uint16_t>(row, span, range, inverse);
      } else {
        invertRow<float>(row, span, range, inverse);
      }
    });
  });
}

/// By lines of one step after the other; no two steps have a kind in common. Lines whose middle is
/// not measured are not looked at.
DepthNoise FrameSensor::estimateNoise(const FrameView& view) const {
  NoiseOfLines kinds[kNoiseKinds] = {};
  const auto measured = [&](int u, int v) { return measured_.row(v)[u]; };
  parallelFor(kNoiseSteps, threads_, [&](size_t step) {
    NoiseBins bins[kNoiseKinds];
    for (int row = 0; row < kNoiseRows; ++row) {
      const PixelSpan& span = measured_.span(noisePoint(0, row, view.width, view.height).v);
      for (int column = 0; column < kNoiseColumns && !span.isEmpty(); ++column) {
        const Pixel middle = noisePoint(column, row, view.width, view.height);
        if (middle.u < span.begin || middle.u >= span.end) continue;
        const NoiseLinePlace place = noiseLinePlace(column, row, middle, static_cast<int>(step));
        const NoiseLine line = noiseLine(measured, view.width, view.height, place);
        const float variance = noiseVariance(line, surfel_settings_);
        if (variance >= 0.0f) bins[place.kind].add(variance);
      }
    }
    for (int kind = 0; kind < kNoiseKinds; ++kind) {
      if (bins[kind].lines > 0) kinds[kind] = bins[kind].noise();
    }
  });
  return {combinedNoise(kinds, surfel_settings_.rules), surfel_settings_.noise_in_depth};
}

/// By filledInverseDepth() only where pixels are empty between two that are not.
void FrameSensor::fillGaps(const FrameView& view, const DepthRange& range,
                           const DepthNoise& noise) {
  const int width = view.width, height = view.height;
  inverse_depth_.resize(width, height);
  const GapLimits limits = gapLimits(surfel_settings_, range, noise);
  const auto measured = [&](int u, int v) { return measured_.row(v)[u]; };
  struct GapRow {
    std::vector<uint8_t> is_gap;
    std::vector<float> nothing;  // above the first row, and below the last one
  };
  parallelFor<GapRow, kRowsAtATime>(height, threads_, [&](size_t v, GapRow& row) {
    row.is_gap.resize(width);
    row.nothing.resize(width);
    const bool is_first = v == 0, is_last = v + 1 == static_cast<size_t>(height);
    PixelSpan span = measured_.span(v);
    if (!is_first) span = unite(span, measured_.span(v - 1));
    if (!is_last) span = unite(span, measured_.span(v + 1));
    const float* const own = measured_.row(v);
    const float* const above = is_first ? row.nothing.data() : own - width;
    const float* const below = is_last ? row.nothing.data() : own + width;
    float* const filled = inverse_depth_.newRow(v, span);
    std::copy(own + span.begin, own + span.end, filled + span.begin);
    bool has_gaps = false;
    withWidestVectors(
        [&] { has_gaps = findGaps(above, own, below, width, span, row.is_gap.data()); });
    for (int u = span.begin; has_gaps && u < span.end; ++u) {
      if (row.is_gap[u] == 0) continue;
      filled[u] = filledInverseDepth(measured, width, height, {u, static_cast<int>(v)}, limits);
    }
    inverse_depth_.newRow(v, measuredSpan<float>(filled, width, span));
  });
}

/// Both in one loop over the rows: the fit of a row needs none but its own links.
void FrameSensor::linkAndFitRows(const FrameView& view, const DepthNoise& noise) {
  const int width = view.width;
  links_.resize(width, view.height);
  row_value_.resize(width, view.height);
  row_slope_.resize(width, view.height);
  const LinkLimits limits = linkLimits(view, noise, surfel_settings_);
  const FitWindow window = fitWindow(view, noise, surfel_settings_);
  const int margin = surfel_settings_.normal_radius_px;
  // In the margin pixels count as unmeasured, which ends a walk just as the image's border does.
  struct PaddedRow {
    std::vector<float> values;
    std::vector<PixelLinks> links;
  };
  parallelFor<PaddedRow, kRowsAtATime>(view.height, threads_, [&](size_t v, PaddedRow& padded) {
    const PixelSpan span = inverse_depth_.span(v);
    PixelLinks* const links = links_.newRow(v, span);
    float* const values = row_value_.newRow(v, span);
    float* const slopes = row_slope_.newRow(v, span);
    if (span.isEmpty()) return;
    withWidestVectors(
        [&] { linkRow(view, inverse_depth_.data(), static_cast<int>(v), span, limits, links); });
    padded.values.assign(width + 2 * margin, 0.0f);
    padded.links.assign(width + 2 * margin, 0);
    std::copy_n(inverse_depth_.row(v), width, padded.values.data() + margin);
    std::copy_n(links, width, padded.links.data() + margin);
    StretchFit fits;
    for (int first = span.begin; first < span.end; first += kStretch) {
      const int count = std::min(kStretch, span.end - first);
      const float* centres = padded.values.data() + margin + first;
      fits.compute({count, {centres, centres, padded.links.data() + margin + first}},
                   {1, kLinkRight, margin, margin, margin}, window);
      for (int i = 0; i < count; ++i) {
        const RowFit fit = rowFitOf(fits.fit(i));
        values[first + i] = fit.value;
        slopes[first + i] = fit.slope;
      }
    }
  });
}

/// And the greatest ones of fine patches, with the rows of these, and of coarse ones.
void FrameSensor::findFreeDepths(const FrameSensing& sensing) {
  const FrameView& view = sensing.image.frame;
  const int columns = freePatchesAlong(view.width, kFinePatchLog2);
  const int rows = freePatchesAlong(view.height, kFinePatchLog2);
  free_depth_.resize(view.width, view.height);
  most_free_.resize(freePatchCount(view, kFinePatchLog2) + freePatchCount(view, kCoarsePatchLog2));
  parallelFor<std::vector<float>>(rows, threads_, [&](size_t row, std::vector<float>& greatest) {
    const int first_v = static_cast<int>(row) << kFinePatchLog2;
    PixelSpan all{0, 0};
    for (int v = first_v; v < std::min(first_v + (1 << kFinePatchLog2), view.height); ++v) {
      const PixelSpan span = inverse_depth_.span(v);
      float* const free_depth = free_depth_.newRow(v, span);
      withWidestVectors(
          [&] { findFreeDepthsOfRow(sensing, v, span, fusion_settings_, free_depth); });
      all = unite(all, span);
    }
    findGreatest({free_depth_.data(), view.width, view.height}, first_v, 1 << kFinePatchLog2, all,
                 greatest, &most_free_[row * columns]);
  });
  constexpr int kSideLog2 = kCoarsePatchLog2 - kFinePatchLog2;
  std::vector<float> greatest;
  float* coarse = &most_free_[freePatchCount(view, kFinePatchLog2)];
  for (int row = 0; row < rows; row += 1 << kSideLog2) {
    findGreatest({most_free_.data(), columns, rows}, row, 1 << kSideLog2, {0, columns}, greatest,
                 coarse);
    coarse += freePatchesAlong(view.width, kCoarsePatchLog2);
  }
}

size_t FrameSensor::bytes() const {
  return measured_.bytes() + inverse_depth_.bytes() + row_value_.bytes() + row_slope_.bytes() +
         free_depth_.bytes() + links_.bytes() + most_free_.capacity() * sizeof(float);
}

}  // namespace dtsdf
