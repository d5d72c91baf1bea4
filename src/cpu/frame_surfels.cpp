#include "cpu/frame_surfels.h"

#include <algorithm>

#include "cpu/parallel_for.h"
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

void FrameSurfels::fitRows(const DepthFrame& frame, const FrameView& view,
                           const FusionParams& params, int threads) {
  const int width = view.width, height = view.height;
  const size_t pixels = static_cast<size_t>(width) * height;
  inverse_depth_.resize(pixels);
  row_value_.resize(pixels);
  row_slope_.resize(pixels);
  const NormalFitSettings settings = makeNormalFitSettings(params, view);
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int v = 0; v < height; ++v) {
    float* row = &inverse_depth_[static_cast<size_t>(v) * width];
    for (int u = 0; u < width; ++u) {
      row[u] = inverseDepth(rawValue(frame, u, v), frame.unit_m, params.min_depth_m,
                            params.max_depth_m);
    }
    for (int u = 0; u < width; ++u) {
      const RowFit fit = fitRow(inverse_depth_.data(), width, u, v, settings);
      row_value_[static_cast<size_t>(v) * width + u] = fit.value;
      row_slope_[static_cast<size_t>(v) * width + u] = fit.slope;
    }
  }
}

size_t FrameSurfels::computePixels(const DepthFrame& frame, const FrameView& view,
                                   const FusionParams& params, int threads) {
  fitRows(frame, view, params, threads);
  surfels_.resize(inverse_depth_.size());
  const NormalFitSettings settings = makeNormalFitSettings(params, view);
  size_t count = 0;
#pragma omp parallel for schedule(static) num_threads(threads) reduction(+ : count)
  for (int v = 0; v < view.height; ++v) {
    for (int u = 0; u < view.width; ++u) {
      const size_t i = static_cast<size_t>(v) * view.width + u;
      surfels_[i] = computeSurfel(view, images(), u, v, settings);
      count += surfels_[i].weight > 0.0f;
    }
  }
  return count;
}

size_t FrameSurfels::computeGroups(const DepthFrame& frame, const FrameView& view,
                                   const FusionParams& params, int threads) {
  fitRows(frame, view, params, threads);
  const NormalFitSettings settings = makeNormalFitSettings(params, view);
  const GroupSettings groups = makeGroupSettings(params, view);
  rows_of_tiles_.resize(tilesAlong(view.height));
  struct NoScratch {};
  parallelFor<NoScratch>(rows_of_tiles_.size(), threads, [&](size_t row, NoScratch&) {
    std::vector<Surfel>& surfels = rows_of_tiles_[row];
    surfels.clear();
    const int first_v = static_cast<int>(row) * kTileSide;
    const int end_v = std::min(first_v + kTileSide, view.height);
    for (int first_u = 0; first_u < view.width; first_u += kTileSide) {
      const TileGroups tile =
          groupTile(images(), view.width, view.height, first_u, first_v, groups);
      const int end_u = std::min(first_u + kTileSide, view.width);
      for (int v = first_v; v < end_v; ++v) {
        for (int u = first_u; u < end_u; ++u) {
          const Surfel surfel = computeLeadSurfel(view, images(), tile, u, v, settings);
          if (surfel.weight > 0.0f) surfels.push_back(surfel);
        }
      }
    }
  });
  surfels_.clear();
  for (const std::vector<Surfel>& row : rows_of_tiles_) {
    surfels_.insert(surfels_.end(), row.begin(), row.end());
  }
  return surfels_.size();
}

}  // namespace dtsdf
