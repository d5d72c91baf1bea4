/// Straight lines through inverse depths along a row or down a column, up to the next jump.
#pragma once

#include "kernels/surfels/depth.h"

namespace dtsdf {

/// What decides how many pixels a fit takes to each side.
struct FitWindow {
  float voxels_px_m;  ///< The window that the voxels ask for, in pixels at 1 m.
  float least_px, most_px;
  float noise_px;     ///< Noise of a slope between neighbours as an angle, at 1 m, ...
  float turn;         ///< ... and how much of it remains, times the square of the radius.
};

/// The slope of a plane fitted over a square window of half width r has the standard deviation of a
/// sample divided by sqrt(sum of k^2), which is 1.155 (r + 1/2)^2; times focal length and depth
/// this is an angle.
DTSDF_HD FitWindow fitWindow(const FrameView& frame, float sigma, const SurfelSettings& surfels) {
  const SurfelRules& rules = surfels.rules;
  const float voxel_px_m = frame.intrinsics.fx * frame.voxel_size_m;
  return {rules.window_voxels * voxel_px_m, rules.least_window_px,
          static_cast<float>(surfels.normal_radius_px), sigma * frame.intrinsics.fx,
          1.155f * rules.largest_noise_turn};
}

/// As wide as the voxels or the noise ask for, within the limits.
DTSDF_HD int windowRadius(float inverse_depth, const FitWindow& window) {
  const float for_noise = sqrtf(window.noise_px / (window.turn * inverse_depth));
  const float radius =
      maximum(maximum(window.voxels_px_m * inverse_depth, window.least_px), for_noise);
  return static_cast<int>(minimum(radius, window.most_px) + 0.5f);
}

/// A line of pixels around a centre.
struct PixelLine {
  int64_t stride;     ///< From one to the next.
  int before, after;  ///< So many to either side.
};

/// The pixels around number `at` of `count`, `radius` to either side where the image has them.
DTSDF_HD PixelLine lineAround(int at, int count, int64_t stride, int radius) {
  const int last = count - 1 - at;
  return {stride, at < radius ? at : radius, last < radius ? last : radius};
}

/// A straight line through samples of inverse depth, at the centre of the walk.
struct LineFit {
  float value;
  float slope;           ///< Per pixel.
  float mean_companion;  ///< Mean of the companions of the samples that were taken.
  int32_t count;         ///< Samples taken, the centre included; a slope needs two.
};

/// Sums over the samples that were taken, each at an offset k and with a value y relative to the
/// centre's, and over another value of the same pixel, its companion.
struct LineSums {
  float y, ky, companion;
};

/// A walk from the centre to one side.
struct LineWalk {
  int32_t open;  ///< 1 until the walk ends, then 0.
  float steps;   ///< Samples taken.
  LineSums sums;
};

/// Takes a sample unless the walk has ended, or ends here since the sample does not continue it
/// (0). Branch-free, so that the CPU can walk from several pixels at once.
DTSDF_HD void takeSample(LineWalk& walk, int32_t continues, float k, float y, float companion) {
  walk.open &= continues;
  const float taken = static_cast<float>(walk.open);
  walk.steps += taken;
  walk.sums.y += taken * y;
  walk.sums.ky += taken * (k * y);
  walk.sums.companion += taken * companion;
}

/// 1 where a walk goes on from one inverse depth to the next: both are measured, without a jump.
DTSDF_HD int32_t continuesWalk(float previous, float current, const SurfelSettings& surfels) {
  return static_cast<int32_t>(current > 0.0f) &
         static_cast<int32_t>(depthsConnected(previous, current, surfels));
}

/// The line through the samples at offsets -before..after around one with the value `origin`.
DTSDF_HD LineFit finishLine(float origin, float before, float after, const LineSums& sums) {
  const float n = 1.0f + before + after;
  const float sum_k = 0.5f * (after * (after + 1.0f) - before * (before + 1.0f));
  const float sum_kk = (after * (after + 1.0f) * (2.0f * after + 1.0f) +
                        before * (before + 1.0f) * (2.0f * before + 1.0f)) / 6.0f;
  const float spread = n * sum_kk - sum_k * sum_k;
  const float slope = (n * sums.ky - sum_k * sums.y) / (n > 1.0f ? spread : 1.0f);
  const float value = origin + (sums.y - slope * sum_k) / n;
  return {value, slope, sums.companion / n, static_cast<int32_t>(n)};
}

/// Fits a line to the inverse depths around `centre`, ending at pixels without one and at jumps.
/// `companion` are the companions, likewise around the centre.
DTSDF_HD LineFit fitLine(const float* centre, const float* companion, const PixelLine& line,
                         const SurfelSettings& surfels) {
  LineSums sums{0.0f, 0.0f, *companion};
  float taken[2];
  for (int side = 0; side < 2; ++side) {
    const int steps = side == 0 ? line.before : line.after;
    float previous = *centre;
    LineWalk walk{1, 0.0f, sums};
    for (int step = 1; step <= steps && walk.open != 0; ++step) {
      const int k = side == 0 ? -step : step;
      const int64_t at = k * line.stride;
      const float current = centre[at];
      takeSample(walk, continuesWalk(previous, current, surfels), static_cast<float>(k),
                 current - *centre, companion[at]);
      previous = current;
    }
    taken[side] = walk.steps;
    sums = walk.sums;
  }
  return finishLine(*centre, taken[0], taken[1], sums);
}

}  // namespace dtsdf
