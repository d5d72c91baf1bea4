#include "cpu/make_surfels.h"

#include <algorithm>
#include <numeric>

#include "backend/rule_settings.h"
#include "cpu/stretch_fit.h"
#include "threads/parallel_for.h"

namespace dtsdf {
namespace {

struct NoScratch {};

}  // namespace

SurfelMaker::SurfelMaker(const MapperParams& params, const SurfelRules& rules, int threads)
    : merges_(castsSurfels(params)),
      surfel_settings_(makeSurfelSettings(params, rules)),
      threads_(threads) {}

void SurfelMaker::makeSurfels(const FrameSensing& sensing) {
  if (merges_) {
    makeListOfSurfels(sensing);
  } else {
    makePixelSurfels(sensing);
  }
}

/// Calls visit(u, fit along the column) for those pixels of a stretch of a row that are wanted.
template <class IsWanted, class Visit>
void SurfelMaker::visitColumnFits(const FrameSensing& sensing, const Pixel& first,
                                  const IsWanted& is_wanted, const Visit& visit) const {
  const FrameView& frame = sensing.image.frame;
  const int count = std::min(kStretch, frame.width - first.u);
  bool any = false;
  for (int i = 0; i < count; ++i) any |= is_wanted(first.u + i);
  if (!any) return;
  const int64_t at = pixelIndex(frame, first);
  StretchFit fits;
  const int32_t largest = surfel_settings_.normal_radius_px;
  const LineSamples samples{sensing.image.row_value + at, sensing.image.row_slope + at,
                            sensing.image.links + at};
  fits.compute({count, samples}, columnAround(first.v, frame, {largest, largest}),
               fitWindow(frame, sensing.noise, surfel_settings_));
  for (int i = 0; i < count; ++i) {
    if (is_wanted(first.u + i)) visit(first.u + i, fits.fit(i));
  }
}

/// @return the number of surfels with a weight.
size_t SurfelMaker::makeRow(const FrameSensing& sensing, int v) {
  const FrameView& frame = sensing.image.frame;
  Surfel* surfels = &lists_.front()[static_cast<size_t>(v) * frame.width];
  const auto everywhere = [](int) { return true; };
  for (int first = 0; first < frame.width && surfel_settings_.normal_radius_px > 0;
       first += kStretch) {
    visitColumnFits(sensing, {first, v}, everywhere, [&](int u, const LineFit& column) {
      const PixelMeasurement pixel = wholePixel(sensing, {u, v}, column, surfel_settings_);
      surfels[u] = makeWholePixelSurfel(sensing.image, pixel);
    });
  }
  for (int u = 0; u < frame.width && surfel_settings_.normal_radius_px == 0; ++u) {
    surfels[u] = makePointSurfel(sensing.image, {u, v});
  }
  return std::count_if(surfels, surfels + frame.width,
                       [](const Surfel& surfel) { return surfel.weight > 0.0f; });
}

void SurfelMaker::makePixelSurfels(const FrameSensing& sensing) {
  const FrameView& frame = sensing.image.frame;
  lists_.resize(1);
  lists_.front().resize(static_cast<size_t>(frame.width) * frame.height);
  std::vector<size_t> counts(frame.height, 0);
  parallelFor<NoScratch>(frame.height, threads_, [&](size_t row, NoScratch&) {
    counts[row] = makeRow(sensing, static_cast<int>(row));
  });
  count_ = std::accumulate(counts.begin(), counts.end(), size_t{0});
}

void SurfelMaker::makeListOfSurfels(const FrameSensing& sensing) {
  lists_.resize(tilesAlong(sensing.image.frame.height));
  parallelFor<std::vector<MergedTile>>(
      lists_.size(), threads_, [&](size_t row, std::vector<MergedTile>& tiles) {
        lists_[row].clear();
        makeTiles(sensing, static_cast<int>(row) * kTileSide, tiles, lists_[row]);
      });
  count_ = 0;
  for (const std::vector<Surfel>& list : lists_) count_ += list.size();
}

void SurfelMaker::makeTiles(const FrameSensing& sensing, int first_v,
                            std::vector<MergedTile>& tiles, std::vector<Surfel>& surfels) const {
  const FrameView& frame = sensing.image.frame;
  const int end_v = std::min(first_v + kTileSide, frame.height);
  PixelSpan span{0, 0};
  for (int v = first_v; v < end_v; ++v) {
    const float* row = sensing.image.inverse_depth + pixelIndex(frame, {0, v});
    span = unite(span, measuredSpan(row, frame.width));
  }
  tiles.resize(tilesAlong(frame.width));
  for (int u = span.begin; u < span.end; u += kTileSide) {
    tiles[u / kTileSide] = mergeTile(sensing.image, {u, first_v}, surfel_settings_);
  }
  for (int v = first_v; v < end_v; ++v) {
    makeSingles(sensing, v, span, tiles, surfels);
    for (int u = span.begin; u < span.end; u += kQuadSide) {
      const int side = mergedSide(tiles[u / kTileSide], {u, v});
      if (side <= 1) continue;
      const Surfel surfel = makeMergedSurfel(sensing, {{u, v}, side}, surfel_settings_);
      if (surfel.weight > 0.0f) surfels.push_back(surfel);
    }
  }
}

/// Appends the surfels of those pixels of a row that are not merged.
void SurfelMaker::makeSingles(const FrameSensing& sensing, int v, const PixelSpan& span,
                              const std::vector<MergedTile>& tiles,
                              std::vector<Surfel>& surfels) const {
  const FrameView& frame = sensing.image.frame;
  const float* measured = sensing.image.inverse_depth + pixelIndex(frame, {0, v});
  const auto isSingle = [&](int u) {
    return measured[u] > 0.0f && mergedSide(tiles[u / kTileSide], {u, v}) == 1;
  };
  const auto make = [&](int u, const LineFit& column) {
    const PixelMeasurement pixel = subdividedPixel(sensing, {u, v}, column, surfel_settings_);
    const int count = subpixelCount(pixel.subdivision);
    for (int i = 0; i < count; ++i) {
      const Surfel surfel = makeSubpixelSurfel(sensing.image, pixel, i);
      if (surfel.weight > 0.0f) surfels.push_back(surfel);
    }
  };
  for (int u = span.begin; u < span.end; u += kStretch) {
    visitColumnFits(sensing, {u, v}, isSingle, make);
  }
}

size_t SurfelMaker::bytes() const {
  size_t surfels = 0;
  for (const std::vector<Surfel>& list : lists_) surfels += list.capacity();
  return surfels * sizeof(Surfel);
}

}  // namespace dtsdf
