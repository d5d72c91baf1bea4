#include "cpu/frame_surfels.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "backend/fusion_view.h"
#include "cpu/line_fits.h"
#include "cpu/parallel_for.h"
#include "kernels/surfels/depth_noise.h"

namespace dtsdf {
namespace {

float rawValue(const DepthFrame& frame, int u, int v) {
  const char* row = static_cast<const char*>(frame.data) + static_cast<size_t>(v) * frame.row_bytes;
  if (frame.encoding == DepthEncoding::kUint16) {
    return static_cast<float>(reinterpret_cast<const uint16_t*>(row)[u]);
  }
  return reinterpret_cast<const float*>(row)[u];
}

float inverseDepthAt(const DepthFrame& frame, const FusionParams& params, int u, int v) {
  return inverseDepth(rawValue(frame, u, v), frame.unit_m, params.min_depth_m, params.max_depth_m);
}

/// Standard deviation of a frame's inverse depth, in 1/m.
float estimateNoise(const DepthFrame& frame, const FusionParams& params) {
  std::array<uint32_t, kNoiseBins> bins{};
  uint32_t lines = 0;
  for (int i = 0; i < kNoisePoints; ++i) {
    const NoisePoint at = noisePoint(i, frame.width, frame.height);
    if (at.u < kNoiseRadius || at.u + kNoiseRadius >= frame.width) continue;
    float line[kNoiseLength];
    for (int k = 0; k < kNoiseLength; ++k) {
      line[k] = inverseDepthAt(frame, params, at.u + k - kNoiseRadius, at.v);
    }
    const float variance = varianceAboutLine(line, params.depth_jump);
    if (variance < 0.0f) continue;
    ++bins[noiseBin(variance)];
    ++lines;
  }
  if (lines < kLeastNoiseLines) return 0.0f;
  uint32_t below = 0;
  int bin = 0;
  while ((below += bins[bin]) <= medianRank(lines)) ++bin;
  return noiseOfBin(bin);
}

}  // namespace

void FrameSurfels::fitRows(const DepthFrame& frame, const FrameView& view,
                           const MapperParams& params, int threads) {
  const int width = view.width;
  const size_t pixels = static_cast<size_t>(width) * view.height;
  inverse_depth_.resize(pixels);
  row_value_.resize(pixels);
  row_slope_.resize(pixels);
  noise_ = estimateNoise(frame, params.fusion);
  const NormalFitSettings settings = makeNormalFitSettings(params, view, noise_);
  const int margin = settings.radius_px;
  // In the margin pixels count as unmeasured, which ends a walk just as the image's border does.
  using PaddedRow = std::vector<float>;
  parallelFor<PaddedRow>(view.height, threads, [&](size_t v, PaddedRow& row) {
    row.assign(width + 2 * margin, 0.0f);
    float* values = row.data() + margin;
    for (int u = 0; u < width; ++u) {
      values[u] = inverseDepthAt(frame, params.fusion, u, static_cast<int>(v));
    }
    std::copy(values, values + width, &inverse_depth_[v * width]);
    StretchFit fits;
    for (int first = 0; first < width; first += kStretch) {
      const int count = std::min(kStretch, width - first);
      fits.compute(count, values + first, values + first, 1, margin, margin, settings);
      for (int i = 0; i < count; ++i) {
        const RowFit fit = rowFitOf(fits.fit(i));
        row_value_[v * width + first + i] = fit.value;
        row_slope_[v * width + first + i] = fit.slope;
      }
    }
  });
}

/// Calls visit(u, fit along the column) for those pixels of a stretch of row v that are wanted.
template <class IsWanted, class Visit>
void FrameSurfels::visitColumnFits(const FrameView& view, const NormalFitSettings& settings, int u,
                                   int v, const IsWanted& is_wanted, const Visit& visit) const {
  const int count = std::min(kStretch, view.width - u);
  bool any = false;
  for (int i = 0; i < count; ++i) any |= is_wanted(u + i);
  if (!any) return;
  const size_t first = static_cast<size_t>(v) * view.width + u;
  StretchFit fits;
  fits.compute(count, &row_value_[first], &row_slope_[first], view.width,
               std::min(v, settings.radius_px), std::min(view.height - 1 - v, settings.radius_px),
               settings);
  for (int i = 0; i < count; ++i) {
    if (is_wanted(u + i)) visit(u + i, fits.fit(i));
  }
}

size_t FrameSurfels::computePixels(const DepthFrame& frame, const FrameView& view,
                                   const MapperParams& params, int threads) {
  fitRows(frame, view, params, threads);
  surfels_.resize(inverse_depth_.size());
  const NormalFitSettings settings = makeNormalFitSettings(params, view, noise_);
  std::vector<size_t> counts(view.height, 0);
  struct NoScratch {};
  parallelFor<NoScratch>(view.height, threads, [&](size_t row, NoScratch&) {
    const int v = static_cast<int>(row);
    const auto store = [&](int u, const Surfel& surfel) {
      surfels_[row * view.width + u] = surfel;
      counts[row] += surfel.weight > 0.0f;
    };
    if (settings.radius_px == 0) {
      for (int u = 0; u < view.width; ++u) {
        store(u, makePoint(view, u, v, inverse_depth_[row * view.width + u]));
      }
      return;
    }
    const auto everywhere = [](int) { return true; };
    for (int first = 0; first < view.width; first += kStretch) {
      visitColumnFits(view, settings, first, v, everywhere, [&](int u, const LineFit& column) {
        const PixelMeasurement pixel = wholePixel(view, images(), u, v, column, settings);
        store(u, makePartSurfel(view, images(), pixel, 0));
      });
    }
  });
  return std::accumulate(counts.begin(), counts.end(), size_t{0});
}

size_t FrameSurfels::computeGroups(const DepthFrame& frame, const FrameView& view,
                                   const MapperParams& params, int threads) {
  fitRows(frame, view, params, threads);
  computeFreeDepth(view, params, threads);
  rows_of_tiles_.resize(tilesAlong(view.height));
  parallelFor<std::vector<TileGroups>>(
      rows_of_tiles_.size(), threads, [&](size_t row, std::vector<TileGroups>& tiles) {
        rows_of_tiles_[row].clear();
        computeTiles(view, params, static_cast<int>(row) * kTileSide, tiles, rows_of_tiles_[row]);
      });
  surfels_.clear();
  for (const std::vector<Surfel>& row : rows_of_tiles_) {
    surfels_.insert(surfels_.end(), row.begin(), row.end());
  }
  return surfels_.size();
}

void FrameSurfels::computeFreeDepth(const FrameView& view, const MapperParams& params,
                                    int threads) {
  free_depth_.resize(inverse_depth_.size());
  const FreeSpaceSettings settings = makeFreeSpaceSettings(params, noise_);
  struct NoScratch {};
  parallelFor<NoScratch>(view.height, threads, [&](size_t row, NoScratch&) {
    for (int u = 0; u < view.width; ++u) {
      free_depth_[row * view.width + u] =
          dtsdf::freeDepth(view, images(), u, static_cast<int>(row), settings);
    }
  });
}

size_t FrameSurfels::bytes() const {
  size_t surfels = surfels_.capacity();
  for (const std::vector<Surfel>& row : rows_of_tiles_) surfels += row.capacity();
  return (inverse_depth_.capacity() + row_value_.capacity() + row_slope_.capacity() +
          free_depth_.capacity()) *
             sizeof(float) + surfels * sizeof(Surfel);
}

void FrameSurfels::computeTiles(const FrameView& view, const MapperParams& params, int first_v,
                                std::vector<TileGroups>& tiles,
                                std::vector<Surfel>& surfels) const {
  const NormalFitSettings settings = makeNormalFitSettings(params, view, noise_);
  const GroupSettings groups = makeGroupSettings(params, view);
  tiles.resize(tilesAlong(view.width));
  for (size_t i = 0; i < tiles.size(); ++i) {
    tiles[i] = groupTile(images(), view.width, view.height, static_cast<int>(i) * kTileSide,
                         first_v, groups);
  }
  const auto keep = [&](const Surfel& surfel) {
    if (surfel.weight > 0.0f) surfels.push_back(surfel);
  };
  for (int v = first_v; v < std::min(first_v + kTileSide, view.height); ++v) {
    const auto sideAt = [&](int u) { return groupSide(tiles[u / kTileSide], u, v); };
    const float* measured = &inverse_depth_[static_cast<size_t>(v) * view.width];
    const auto isSingle = [&](int u) { return measured[u] > 0.0f && sideAt(u) == 1; };
    const auto keepParts = [&](int u, const LineFit& column) {
      const PixelMeasurement pixel = dividedPixel(view, images(), u, v, column, settings);
      const int parts = partCount(pixel.parts);
      for (int i = 0; i < parts; ++i) keep(makePartSurfel(view, images(), pixel, i));
    };
    for (int u = 0; u < view.width; u += kStretch) {
      visitColumnFits(view, settings, u, v, isSingle, keepParts);
    }
    for (int u = 0; u < view.width; u += kQuadSide) {
      const int side = sideAt(u);
      if (side > 1) keep(computeGroupSurfel(view, images(), u, v, side, settings));
    }
  }
}

}  // namespace dtsdf
