/// Straight lines through inverse depths along a row or down a column, as far as pixels are linked.
#pragma once

#include "kernels/surfels/links.h"

namespace dtsdf {

/// What decides how many pixels a fit takes to each side.
struct FitWindow {
  float voxels_px_m;  ///< The window that the voxels ask for, in pixels at 1 m.
  float least_px, most_px;
  DepthNoise noise;
  float focal_px;
  float turn;  ///< What may remain of the noise as an angle, times the square of the radius.
};

/// The slope of a plane fitted over a square window of half width r has the standard deviation of a
/// sample divided by sqrt(sum of k^2), which is 1.155 (r + 1/2)^2; times focal length and depth
/// this is an angle.
DTSDF_HD FitWindow fitWindow(const FrameView& frame, const DepthNoise& noise,
                             const SurfelSettings& surfels) {
  const SurfelRules& rules = surfels.rules;
  const float voxel_px_m = frame.intrinsics.fx * frame.voxel_size_m;
  return {rules.window_voxels * voxel_px_m, rules.least_window_px,
          static_cast<float>(surfels.normal_radius_px), noise, frame.intrinsics.fx,
          1.155f * rules.largest_noise_turn};
}

/// As wide as the voxels or the noise ask for, within the limits.
DTSDF_HD int windowRadius(float inverse_depth, const FitWindow& window) {
  const float noise_px = noiseAt(window.noise, inverse_depth) * window.focal_px;
  const float for_noise = sqrtf(noise_px / (window.turn * inverse_depth));
  const float radius =
      maximum(maximum(window.voxels_px_m * inverse_depth, window.least_px), for_noise);
  return static_cast<int>(minimum(radius, window.most_px) + 0.5f);
}

/// A line of pixels around a centre.
struct PixelLine {
  int64_t stride;     ///< From one to the next.
  PixelLinks link;    ///< The link that a pixel has to the next: kLinkRight or kLinkDown.
  int before, after;  ///< So many to either side.
};

/// The pixels around number `at` of `count`, `radius` to either side where the image has them.
DTSDF_HD PixelLine lineAround(int at, int count, int64_t stride, PixelLinks link, int radius) {
  const int last = count - 1 - at;
  return {stride, link, at < radius ? at : radius, last < radius ? last : radius};
}

/// The pixels of a row around column u.
DTSDF_HD PixelLine rowAround(int u, int width, int radius) {
  return lineAround(u, width, 1, kLinkRight, radius);
}

/// The pixels of a column around row v.
DTSDF_HD PixelLine columnAround(int v, const FrameView& frame, int radius) {
  return lineAround(v, frame.height, frame.width, kLinkDown, radius);
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

/// 1 where a walk goes on to a pixel: it has a value, and is linked to the one before. `links` are
/// those of whichever of the two comes first in the image.
DTSDF_HD int32_t continuesWalk(float current, PixelLinks links, PixelLinks link) {
  return static_cast<int32_t>(current > 0.0f) & static_cast<int32_t>((links & link) != 0);
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

/// What a line is fitted to: pointers to the centre's in images of inverse depth, of companions,
/// and of links.
struct LineSamples {
  const float* value;
  const float* companion;
  const PixelLinks* links;
};

/// Fits a line to the inverse depths around a centre, ending at pixels without one and where pixels
/// are not linked.
DTSDF_HD LineFit fitLine(const LineSamples& centre, const PixelLine& line) {
  LineSums sums{0.0f, 0.0f, *centre.companion};
  float taken[2];
  for (int side = 0; side < 2; ++side) {
    const int steps = side == 0 ? line.before : line.after;
    LineWalk walk{1, 0.0f, sums};
    for (int step = 1; step <= steps && walk.open != 0; ++step) {
      const int k = side == 0 ? -step : step;
      const int64_t at = k * line.stride;
      const float current = centre.value[at];
      const PixelLinks links = centre.links[side == 0 ? at : at - line.stride];
      takeSample(walk, continuesWalk(current, links, line.link), static_cast<float>(k),
                 current - *centre.value, centre.companion[at]);
    }
    taken[side] = walk.steps;
    sums = walk.sums;
  }
  return finishLine(*centre.value, taken[0], taken[1], sums);
}

}  // namespace dtsdf
