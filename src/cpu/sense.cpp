#include "cpu/sense.h"

#include <algorithm>
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
  const auto* const bytes = static_cast<const char*>(row);  // rows may have any alignment
  const DepthRange range = depth_range;  // a copy, as stores may alias the reference
  for (int u = span.begin; u < span.end; ++u) {
    Raw raw;
    std::memcpy(&raw, bytes + u * sizeof(Raw), sizeof(Raw));
    inverse_depth[u] = inverseDepth(static_cast<float>(raw), range);
  }
}

void findFreeDepthsOfRow(const FrameSensing& of_frame, int v, const PixelSpan& span,
                         const FusionSettings& settings, float* __restrict__ free_depth) {
  const FrameSensing sensing = of_frame;  // copies, as stores may alias references
  const FusionSettings fusion = settings;
  const ImageView& image = sensing.image;
  const int64_t first = pixelIndex(image.frame, {0, v}), width = image.frame.width;
  const bool has_above = v > 0, has_below = v < image.frame.height - 1;
  const float* const value = image.row_value + first;
  const PixelLinks* const links = image.links + first;
  const float* const above = has_above ? value - width : value;  // any row will do: its factor is 0
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

/// Finds the maximum free depth in each patch of a row of patches that starts at pixel row
/// `first_v`. Depths outside `span` are 0.
void findPatchMaxima(const FrameView& frame, const float* free_depth, int first_v,
                     const PixelSpan& span, float* patches) {
  const int end_v = std::min(first_v + kFreePatchSide, frame.height);
  std::fill_n(patches, freePatchesAlong(frame.width), 0.0f);
  for (int v = first_v; v < end_v; ++v) {
    const float* const row = free_depth + pixelIndex(frame, {0, v});
    for (int u = span.begin; u < span.end; ++u) {
      float& greatest = patches[u >> kFreePatchSideLog2];
      greatest = maximum(greatest, row[u]);
    }
  }
}

/// Estimates the noise from each quartile of the lines' variances, given as a histogram. @pre There
/// is at least one line.
NoiseOfLines noiseOf(const uint32_t (&lines_in_bin)[kNoiseBins], uint32_t lines) {
  NoiseOfLines noise{{}, lines};
  uint32_t up_to = lines_in_bin[0];  // lines in bins up to `bin`
  int bin = 0;
  for (int quartile = 0; quartile < kNoiseQuartiles; ++quartile) {
    while (up_to <= quartileRank(lines, quartile)) up_to += lines_in_bin[++bin];
    noise.quartiles[quartile] = noiseOfBin(bin, quartile);
  }
  return noise;
}

/// Finds the pixels of a row that are empty but have a measured neighbour, for
/// filledInverseDepth(). Nothing is measured outside `span` in the row and in those above and
/// below.
/// @param sums A buffer for one value per pixel, and one more at either end.
void findGaps(const float* row, const float* above, const float* below, const PixelSpan& of_row,
              float* __restrict__ sums, int32_t* __restrict__ is_gap) {
  const PixelSpan span = of_row;  // a copy, as stores may alias the reference
  sums[span.begin] = sums[span.end + 1] = 0.0f;
  for (int u = span.begin; u < span.end; ++u) {
    sums[u + 1] = fabsf(above[u]) + fabsf(row[u]) + fabsf(below[u]);
  }
  for (int u = span.begin; u < span.end; ++u) {
    const float around = sums[u] + sums[u + 1] + sums[u + 2];
    is_gap[u] = static_cast<int32_t>(row[u] == 0.0f) & static_cast<int32_t>(around > 0.0f);
  }
}

/// One thread's buffers for a row of pixels.
struct RowBuffers {
  std::vector<float> values;
  std::vector<int32_t> flags;
  std::vector<PixelLinks> links;
};

constexpr size_t kRowsAtATime = 8;  ///< Number of rows that a thread processes at a time.

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
    sensing.max_free = max_free_.data();
  }
  return sensing;
}

/// Skips raw values of 0 at both ends of a row.
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

/// Estimates the noise from lines of pixels. Lines with different steps between their pixels are
/// processed in parallel. Skips lines whose middle is not measured.
DepthNoise FrameSensor::estimateNoise(const FrameView& view) const {
  NoiseOfLines kinds[kNoiseKinds] = {};
  const auto measured = [&](int u, int v) { return measured_.row(v)[u]; };
  parallelFor(kNoiseSteps, threads_, [&](size_t step) {
    uint32_t lines_in_bin[kNoiseKinds][kNoiseBins] = {}, lines[kNoiseKinds] = {};
    for (int row = 0; row < kNoiseRows; ++row) {
      const PixelSpan& span = measured_.span(noisePoint(0, row, view.width, view.height).v);
      for (int column = 0; column < kNoiseColumns && !span.isEmpty(); ++column) {
        const Pixel middle = noisePoint(column, row, view.width, view.height);
        if (middle.u < span.begin || middle.u >= span.end) continue;
        const NoiseLinePlace place = noiseLinePlace(column, row, middle, static_cast<int>(step));
        float line[kNoiseLength];
        if (!readNoiseLine(measured, view.width, view.height, place, line)) continue;
        const float variance = noiseVariance(line, surfel_settings_);
        if (!(variance >= 0.0f)) continue;
        ++lines_in_bin[place.kind][noiseBin(variance)];
        ++lines[place.kind];
      }
    }
    for (int kind = 0; kind < kNoiseKinds; ++kind) {
      if (lines[kind] > 0) kinds[kind] = noiseOf(lines_in_bin[kind], lines[kind]);
    }
  });
  return {combinedNoise(kinds, surfel_settings_.rules), surfel_settings_.noise_in_depth};
}

void FrameSensor::fillGaps(const FrameView& view, const DepthRange& range,
                           const DepthNoise& noise) {
  const int width = view.width, height = view.height;
  inverse_depth_.resize(width, height);
  const auto measured = [&](int u, int v) { return measured_.row(v)[u]; };
  parallelFor<RowBuffers, kRowsAtATime>(height, threads_, [&](size_t row, RowBuffers& buffers) {
    const int v = static_cast<int>(row);
    PixelSpan span = measured_.span(row);
    if (v > 0) span = unite(span, measured_.span(row - 1));
    if (v + 1 < height) span = unite(span, measured_.span(row + 1));
    float* const filled = inverse_depth_.newRow(row, span);
    const float* const own = measured_.row(row);
    std::copy(own + span.begin, own + span.end, filled + span.begin);
    buffers.values.resize(width + 2);
    buffers.flags.resize(width);
    withWidestVectors([&] {
      findGaps(own, v > 0 ? own - width : own, v + 1 < height ? own + width : own, span,
               buffers.values.data(), buffers.flags.data());
    });
    const int32_t* const is_gap = buffers.flags.data();
    for (int u = span.begin; u < span.end; ++u) {
      if (u % kSpanStep == 0 && isBlank<int32_t>(is_gap, u, width)) {
        u += kSpanStep - 1;
      } else if (is_gap[u] != 0) {
        filled[u] = filledInverseDepth(measured, width, height, {u, v}, surfel_settings_, noise,
                                       range.rounded_to_m);
      }
    }
    inverse_depth_.newRow(row, measuredSpan<float>(filled, width, span));
  });
}

/// Links pixels and fits lines in one loop over the rows, as fits need only the links of their row.
void FrameSensor::linkAndFitRows(const FrameView& view, const DepthNoise& noise) {
  const int width = view.width;
  links_.resize(width, view.height);
  row_value_.resize(width, view.height);
  row_slope_.resize(width, view.height);
  const LinkLimits limits = linkLimits(view, noise, surfel_settings_);
  const FitWindow window = fitWindow(view, noise, surfel_settings_);
  const int margin = surfel_settings_.normal_radius_px;
  parallelFor<RowBuffers, kRowsAtATime>(view.height, threads_, [&](size_t v, RowBuffers& padded) {
    const PixelSpan span = inverse_depth_.span(v);
    PixelLinks* const links = links_.newRow(v, span);
    float* const values = row_value_.newRow(v, span);
    float* const slopes = row_slope_.newRow(v, span);
    if (span.isEmpty()) return;
    withWidestVectors([&] {
      for (int u = span.begin; u < span.end; ++u) {
        links[u] = linksOf(view, inverse_depth_.data(), {u, static_cast<int>(v)}, limits);
      }
    });
    // Pixels in the margin are unmeasured, so that fits end there, as at the image border.
    padded.values.resize(width + 2 * margin);
    padded.links.resize(width + 2 * margin);
    std::copy_n(inverse_depth_.row(v), width, padded.values.data() + margin);
    std::copy_n(links, width, padded.links.data() + margin);
    StretchFit fits;
    for (int first = span.begin; first < span.end; first += kStretch) {
      const int count = std::min(kStretch, span.end - first);
      const float* centres = padded.values.data() + margin + first;
      fits.compute(count, {centres, centres, padded.links.data() + margin + first},
                   {1, kLinkRight, margin, margin, margin}, window);
      for (int i = 0; i < count; ++i) {
        const LineFit fit = rowFitOf(fits.fit(i));
        values[first + i] = fit.value;
        slopes[first + i] = fit.slope;
      }
    }
  });
}

/// Finds the free depth of each pixel and, in the same pass, the maximum in each patch.
void FrameSensor::findFreeDepths(const FrameSensing& sensing) {
  const FrameView& view = sensing.image.frame;
  const int columns = freePatchesAlong(view.width), rows = freePatchesAlong(view.height);
  free_depth_.resize(view.width, view.height);
  max_free_.resize(static_cast<size_t>(columns) * rows);
  parallelFor(rows, threads_, [&](size_t row) {
    const int first_v = static_cast<int>(row) * kFreePatchSide;
    PixelSpan all{0, 0};
    for (int v = first_v; v < std::min(first_v + kFreePatchSide, view.height); ++v) {
      const PixelSpan span = inverse_depth_.span(v);
      float* const free_depth = free_depth_.newRow(v, span);
      withWidestVectors(
          [&] { findFreeDepthsOfRow(sensing, v, span, fusion_settings_, free_depth); });
      all = unite(all, span);
    }
    findPatchMaxima(view, free_depth_.data(), first_v, all, &max_free_[row * columns]);
  });
}

size_t FrameSensor::bytes() const {
  return measured_.bytes() + inverse_depth_.bytes() + row_value_.bytes() + row_slope_.bytes() +
         free_depth_.bytes() + links_.bytes() + max_free_.capacity() * sizeof(float);
}

}  // namespace dtsdf
