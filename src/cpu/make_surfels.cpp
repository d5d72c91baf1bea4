#include "cpu/make_surfels.h"

#include <algorithm>

#include "backend/rule_settings.h"
#include "cpu/widest_vectors.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

static_assert(kStretch <= 64, "a stretch must fit in 64 bits");

/// The measured, unmerged pixels among kStretch pixels of a row, up to `end_u`; one bit each.
uint64_t singlesOf(const ImageView& image, const Pixel& first, int end_u,
                   const std::vector<MergedPatch>& patches) {
  const float* measured = image.inverse_depth + pixelIndex(image.frame, first);
  const int pixels = std::min(kStretch, end_u - first.u);
  uint64_t listed = 0;
  for (int u = 0; u < pixels; u += kPatchSide) {
    uint32_t singles = singlesInRow(patches[(first.u + u) / kPatchSide], first.v);
    for (int i = u; singles != 0 && i < pixels; ++i, singles >>= 1) {
      listed |= static_cast<uint64_t>((singles & 1) != 0 && measured[i] > 0.0f) << i;
    }
  }
  return listed;
}

/// Appends a surfel if it has a weight. Assigns in place, as push_back() would stall by loading
/// larger words than were stored.
void append(const Surfel& surfel, std::vector<Surfel>& surfels) {
  if (surfel.weight > 0.0f) surfels.emplace_back() = surfel;
}

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

/// Calls visit(u, fit) with the column fit for each wanted pixel among kStretch pixels of a row.
/// @param wanted One bit per pixel.
template <class Visit>
void SurfelMaker::visitColumnFits(const FrameSensing& sensing, const Pixel& first, uint64_t wanted,
                                  const Visit& visit) const {
  if (wanted == 0) return;
  const FrameView& frame = sensing.image.frame;
  const int64_t at = pixelIndex(frame, first);
  StretchFit fits;
  const int32_t largest = surfel_settings_.normal_radius_px;
  const LineSamples samples{sensing.image.row_value + at, sensing.image.row_slope + at,
                            sensing.image.links + at};
  fits.compute(std::min(kStretch, frame.width - first.u), samples,
               columnAround(first.v, frame, {largest, largest}),
               fitWindow(frame, sensing.noise, surfel_settings_));
  for (; wanted != 0; wanted &= wanted - 1) {
    const int i = __builtin_ctzll(wanted);
    visit(first.u + i, fits.fit(i));
  }
}

void SurfelMaker::makeRow(const FrameSensing& sensing, int v) {
  const FrameView& frame = sensing.image.frame;
  Surfel* surfels = &lists_.front()[static_cast<size_t>(v) * frame.width];
  for (int first = 0; first < frame.width && surfel_settings_.normal_radius_px > 0;
       first += kStretch) {
    const uint64_t all = ~uint64_t{0} >> (64 - std::min(kStretch, frame.width - first));
    visitColumnFits(sensing, {first, v}, all, [&](int u, const LineFit& column) {
      const PixelMeasurement pixel = wholePixel(sensing, {u, v}, column, surfel_settings_);
      surfels[u] = makeWholePixelSurfel(sensing.image, pixel);
    });
  }
  for (int u = 0; u < frame.width && surfel_settings_.normal_radius_px == 0; ++u) {
    surfels[u] = makePointSurfel(sensing.image, {u, v});
  }
}

void SurfelMaker::makePixelSurfels(const FrameSensing& sensing) {
  const FrameView& frame = sensing.image.frame;
  lists_.resize(1);
  lists_.front().resize(static_cast<size_t>(frame.width) * frame.height);
  parallelFor(frame.height, threads_, [&](size_t row) { makeRow(sensing, static_cast<int>(row)); });
}

void SurfelMaker::makeListOfSurfels(const FrameSensing& sensing) {
  lists_.resize(patchesAlong(sensing.image.frame.height));
  using Patches = std::vector<MergedPatch>;
  parallelFor<Patches>(lists_.size(), threads_, [&](size_t row, Patches& patches) {
    lists_[row].clear();
    withWidestVectors(
        [&] { makePatches(sensing, static_cast<int>(row) * kPatchSide, patches, lists_[row]); });
  });
}

inline void SurfelMaker::makePatches(const FrameSensing& sensing, int first_v,
                                     std::vector<MergedPatch>& patches,
                                     std::vector<Surfel>& surfels) const {
  const FrameView& frame = sensing.image.frame;
  const int end_v = std::min(first_v + kPatchSide, frame.height);
  PixelSpan span{0, 0};
  for (int v = first_v; v < end_v; ++v) {
    const float* row = sensing.image.inverse_depth + pixelIndex(frame, {0, v});
    span = unite(span, measuredSpan<float>(row, frame.width, {0, frame.width}));
  }
  patches.resize(patchesAlong(frame.width));
  for (int u = span.begin; u < span.end; u += kPatchSide) {
    patches[u / kPatchSide] = mergePatch(sensing.image, {u, first_v}, surfel_settings_);
  }
  for (int v = first_v; v < end_v; ++v) {
    makeSingles(sensing, v, span, patches, surfels);
    if (v % kQuadSide != 0) continue;  // no merged square starts in this row
    for (int u = span.begin; u < span.end; u += kQuadSide) {
      const int side = mergedSide(patches[u / kPatchSide], {u, v});
      if (side <= 1) continue;
      append(makeMergedSurfel(sensing, {{u, v}, side}, surfel_settings_), surfels);
    }
  }
}

/// Appends the surfels of those pixels of a row that are not merged.
inline void SurfelMaker::makeSingles(const FrameSensing& sensing, int v, const PixelSpan& span,
                                     const std::vector<MergedPatch>& patches,
                                     std::vector<Surfel>& surfels) const {
  const auto make = [&](int u, const LineFit& column) {
    const PixelMeasurement pixel = subdividedPixel(sensing, {u, v}, column, surfel_settings_);
    const int count = subpixelCount(pixel.subdivision);
    for (int i = 0; i < count; ++i) append(makeSubpixelSurfel(sensing.image, pixel, i), surfels);
  };
  for (int u = span.begin; u < span.end; u += kStretch) {
    visitColumnFits(sensing, {u, v}, singlesOf(sensing.image, {u, v}, span.end, patches), make);
  }
}

size_t SurfelMaker::bytes() const {
  size_t surfels = 0;
  for (const std::vector<Surfel>& list : lists_) surfels += list.capacity();
  return surfels * sizeof(Surfel);
}

}  // namespace dtsdf
