/// Fits straight lines to inverse depths along a row or down a column, over linked pixels only.
///
/// On a curved surface, a line fitted to only one side of a pixel would have the slope at the
/// middle of that side. So both sides are cut to the length of the shorter side, unless the noise
/// requires more pixels.
#pragma once

#include "kernels/surfels/links.h"

namespace dtsdf {

/// Parameters of windowRadius().
struct FitWindow {
  float voxels_px_m;  ///< Half width for the voxel size, in pixels at 1 m depth.
  float max_px;       ///< Largest half width.
  DepthNoise noise;
  float focal_px;
  float turn;  ///< 1.155 times the largest standard deviation of a normal's angle.
};

/// With noise sigma, the slope of a plane fitted over a square of half width r has the standard
/// deviation sigma / (1.155 (r + 1/2)^2). Its product with focal length and depth is an angle.
DTSDF_HD FitWindow fitWindow(const FrameView& frame, const DepthNoise& noise,
                             const SurfelSettings& surfels) {
  const SurfelRules& rules = surfels.rules;
  const float voxel_px_m = frame.intrinsics.fx * frame.voxel_size_m;
  return {rules.window_voxels * voxel_px_m, static_cast<float>(surfels.normal_radius_px), noise,
          frame.intrinsics.fx, 1.155f * rules.largest_noise_turn};
}

/// Half widths of a window, in pixels.
struct WindowRadius {
  int32_t both;      ///< While both sides continue; follows from voxel size and noise.
  int32_t one_side;  ///< Once the other side has ended; follows from noise, at least 1.
};

DTSDF_HD WindowRadius windowRadius(float inverse_depth, const FitWindow& window) {
  const float noise_px = noiseAt(window.noise, inverse_depth) * window.focal_px;
  const float for_noise = minimum(sqrtf(noise_px / (window.turn * inverse_depth)), window.max_px);
  const float for_voxels = minimum(window.voxels_px_m * inverse_depth, window.max_px);
  const float for_slope = 1.0f;  // a slope needs two samples
  const float radius = maximum(maximum(for_voxels, for_noise), minimum(for_slope, window.max_px));
  return {static_cast<int32_t>(radius + 0.5f), static_cast<int32_t>(maximum(for_noise, for_slope))};
}

/// A line of pixels around a centre.
struct PixelLine {
  int64_t stride;     ///< Between neighbours in the image arrays.
  PixelLinks link;    ///< Links a pixel to the next one: kLinkRight or kLinkDown.
  int before, after;  ///< Maximum number of pixels on each side.
  int one_side;       ///< Maximum after the other side has ended.
};

/// The line around pixel `at` of a row or column of `count` pixels.
DTSDF_HD PixelLine lineAround(int at, int count, int64_t stride, PixelLinks link,
                              const WindowRadius& radius) {
  const int last = count - 1 - at;
  return {stride, link, at < radius.both ? at : radius.both,
          last < radius.both ? last : radius.both, radius.one_side};
}

/// The pixels around column u in a row.
DTSDF_HD PixelLine rowAround(int u, int width, const WindowRadius& radius) {
  return lineAround(u, width, 1, kLinkRight, radius);
}

/// The pixels around row v in a column.
DTSDF_HD PixelLine columnAround(int v, const FrameView& frame, const WindowRadius& radius) {
  return lineAround(v, frame.height, frame.width, kLinkDown, radius);
}

/// A straight line fitted to inverse depths. Each pixel has a second value, which is averaged over
/// the same samples.
struct LineFit {
  float value;        ///< At the centre.
  float slope;        ///< Per pixel.
  float mean_second;  ///< Mean of the second values of all samples.
  int32_t count;      ///< Number of samples, including the centre; a slope needs two.
};

DTSDF_HD LineFit noFit() { return {0.0f, 0.0f, 0.0f, 0}; }

/// A walk from the centre in both directions, with sums over its samples. y is the value at offset
/// k minus the value at the centre.
struct LineWalk {
  int32_t before_open, after_open;  ///< 1 until that side ends, then 0.
  float before, after;              ///< Number of samples taken.
  float y, ky, second_value;
};

/// A sample on one side: whether the walk continues to it (1 or 0), its value minus the value at
/// the centre, and its second value.
struct SideSample {
  int32_t continues;
  float y, second_value;
};

/// Adds the samples `step` pixels away on both sides, unless the walk has ended on that side. If
/// `may_diverge` is 1, one side may continue without the other. Branch-free, so that the CPU can
/// walk from several pixels at once.
DTSDF_HD void takeStep(LineWalk& walk, float step, int32_t may_diverge, const SideSample& before,
                       const SideSample& after) {
  walk.before_open &= before.continues;
  walk.after_open &= after.continues;
  const int32_t goes_on = may_diverge | (walk.before_open & walk.after_open);
  walk.before_open &= goes_on;
  walk.after_open &= goes_on;
  const auto takes_before = static_cast<float>(walk.before_open);
  const auto takes_after = static_cast<float>(walk.after_open);
  walk.before += takes_before;
  walk.after += takes_after;
  const float y_before = takes_before * before.y, y_after = takes_after * after.y;
  walk.y += y_before + y_after;
  walk.ky += step * (y_after - y_before);
  walk.second_value += takes_before * before.second_value + takes_after * after.second_value;
}

/// Whether a walk continues to a pixel (1 or 0): it has a value, and is linked to the last pixel of
/// the walk. `links` belongs to whichever of the two pixels comes first in the image.
DTSDF_HD int32_t continuesWalk(float current, PixelLinks links, PixelLinks link) {
  return static_cast<int32_t>(current > 0.0f) & static_cast<int32_t>((links & link) != 0);
}

/// The line fitted to the samples of a walk whose centre has the value `origin`.
DTSDF_HD LineFit finishLine(float origin, const LineWalk& walk) {
  const float before = walk.before, after = walk.after;
  const float n = 1.0f + before + after;
  const float sum_k = 0.5f * (after * (after + 1.0f) - before * (before + 1.0f));
  const float sum_kk = (after * (after + 1.0f) * (2.0f * after + 1.0f) +
                        before * (before + 1.0f) * (2.0f * before + 1.0f)) /
                       6.0f;
  const float spread = n * sum_kk - sum_k * sum_k;
  const float slope = (n * walk.ky - sum_k * walk.y) / (n > 1.0f ? spread : 1.0f);
  const float value = origin + (walk.y - slope * sum_k) / n;
  return {value, slope, walk.second_value / n, static_cast<int32_t>(n)};
}

/// The data that a line is fitted to: pointers to the centre's inverse depth, second value and
/// links in their images.
struct LineSamples {
  const float* value;
  const float* second_value;
  const PixelLinks* links;
};

/// The sample at an offset from the centre; read only if `wanted`.
DTSDF_HD SideSample sideSample(const LineSamples& centre, const PixelLine& line, int offset,
                               bool wanted) {
  if (!wanted) return {0, 0.0f, 0.0f};
  const int64_t at = offset * line.stride;
  const PixelLinks links = centre.links[offset < 0 ? at : at - line.stride];
  const float current = centre.value[at];
  return {continuesWalk(current, links, line.link), current - *centre.value,
          centre.second_value[at]};
}

/// Fits a line to the inverse depths around a centre, over measured and linked pixels.
DTSDF_HD LineFit fitLine(const LineSamples& centre, const PixelLine& line) {
  LineWalk walk{1, 1, 0.0f, 0.0f, 0.0f, 0.0f, *centre.second_value};
  for (int step = 1; (walk.before_open | walk.after_open) != 0; ++step) {
    const SideSample before =
        sideSample(centre, line, -step, walk.before_open != 0 && step <= line.before);
    const SideSample after =
        sideSample(centre, line, step, walk.after_open != 0 && step <= line.after);
    takeStep(walk, static_cast<float>(step), static_cast<int32_t>(step <= line.one_side), before,
             after);
  }
  return finishLine(*centre.value, walk);
}

/// A row's fit, as used by the column fits; noFit() if it has no slope.
DTSDF_HD LineFit rowFitOf(const LineFit& fit) { return fit.count < 2 ? noFit() : fit; }

/// The fit around pixel u of a row of inverse depths.
DTSDF_HD LineFit fitRow(const float* row, const PixelLinks* links, int width, int u,
                        const FitWindow& window) {
  const float* centre = row + u;
  if (!(*centre > 0.0f)) return noFit();
  const PixelLine line = rowAround(u, width, windowRadius(*centre, window));
  return rowFitOf(fitLine({centre, centre, links + u}, line));
}

}  // namespace dtsdf
