/// Finds links: pairs of neighbouring pixels that lie on one surface. Their difference in inverse
/// depth is called a step. There are three cases:
///
/// - The pixels have the same depth, to within the noise plus a voxel.
/// - The surface is steep: a neighbouring step in the line and the steps in both adjacent lines are
///   similar, without an allowance for noise. Next to a depth edge, the steps in the line differ;
///   at a mixed pixel (one that averages two surfaces), the steps in the adjacent lines differ.
/// - The surface curves out of sight: the step is much smaller than the jump behind it. Mixed
///   pixels are rarely that close to the surface in front.
#pragma once

#include "kernels/surfels/depth.h"

namespace dtsdf {

/// Limits for a step between neighbours.
struct LinkLimits {
  DepthNoise noise;
  float noise_level;
  float same_m;  ///< Difference in depth that the map does not resolve.
  /// Largest final step of a surface that curves out of sight, relative to inverse depth.
  float rim_slope;
  float turn;       ///< Largest change from one step to the next, relative to the step.
  float rim_share;  ///< Largest final step, relative to the jump behind it.
};

DTSDF_HD LinkLimits linkLimits(const FrameView& frame, const DepthNoise& noise,
                               const SurfelSettings& surfels) {
  const SurfelRules& rules = surfels.rules;
  return {noise,
          rules.noise_level,
          frame.voxel_size_m,
          surfels.depth_jump,
          rules.linked_turn,
          rules.linked_rim_share};
}

/// Difference in inverse depth that the map does not resolve.
DTSDF_HD float mapTolerance(float a, float b, const LinkLimits& limits) {
  return limits.same_m * (a * b);
}

/// Whether a plane with this step in inverse depth predicts a neighbour, to within the noise plus a
/// voxel.
DTSDF_HD bool isPredicted(float from, float to, float step, const LinkLimits& limits) {
  return fabsf((to - from) - step) <=
         noiseOfStep(limits.noise, maximum(from, to), limits.noise_level) +
             mapTolerance(from, to, limits);
}

/// A pixel in a row or column of inverse depths: pixel `at` of `count` in its line, which is line
/// `beside` of `lines` parallel lines.
struct LineInImage {
  const float* inverse_depth;  ///< At the pixel.
  int64_t stride, to_beside;
  int at, count, beside, lines;
};

/// Whether two neighbours are measured and differ by this step, within the tolerance.
DTSDF_HD bool isSameStep(float from, float to, float step, float tolerance) {
  return from > 0.0f && to > 0.0f && fabsf((to - from) - step) <= tolerance;
}

/// Whether a step continues: on at least one side, the next step in the line is similar (within
/// `turn`), and the steps in both adjacent lines are the same.
DTSDF_HD bool stepContinues(const LineInImage& line, float step, const LinkLimits& limits) {
  const float *a = line.inverse_depth, *b = a + line.stride;
  const float same = mapTolerance(*a, *b, limits), turn = maximum(same, limits.turn * fabsf(step));
  const bool before = line.at > 0 && isSameStep(a[-line.stride], *a, step, turn);
  const bool after = line.at + 2 < line.count && isSameStep(*b, b[line.stride], step, turn);
  if (!before && !after) return false;
  const int64_t d = line.to_beside;
  return (line.beside == 0 || isSameStep(a[-d], b[-d], step, same)) &&
         (line.beside + 1 == line.lines || isSameStep(a[d], b[d], step, same));
}

/// Whether a surface curves out of sight with this step: the pixel beyond the step must be much
/// farther away, or not fused at all.
DTSDF_HD bool curvesOutOfSight(const LineInImage& line, float step, const LinkLimits& limits) {
  const float *a = line.inverse_depth, *b = a + line.stride;
  if (fabsf(step) > limits.rim_slope * maximum(*a, *b)) return false;
  const bool ends_at_a = step > 0.0f;
  if (ends_at_a ? line.at == 0 : line.at + 2 == line.count) return false;
  const float behind = ends_at_a ? a[-line.stride] : b[line.stride];
  return fabsf(step) <= limits.rim_share * (minimum(*a, *b) - maximum(behind, 0.0f));
}

/// Whether a pixel and the next in line lie on one surface.
DTSDF_HD bool areLinked(const LineInImage& line, const LinkLimits& limits) {
  if (line.at + 1 >= line.count) return false;
  const float a = *line.inverse_depth, b = line.inverse_depth[line.stride];
  if (!(a > 0.0f && b > 0.0f)) return false;
  return isPredicted(a, b, 0.0f, limits) || stepContinues(line, b - a, limits) ||
         curvesOutOfSight(line, b - a, limits);
}

/// The links of a pixel in an image of inverse depths.
DTSDF_HD PixelLinks linksOf(const FrameView& frame, const float* inverse_depth, const Pixel& pixel,
                            const LinkLimits& limits) {
  const float* centre = inverse_depth + pixelIndex(frame, pixel);
  const int64_t width = frame.width;
  const LineInImage row{centre, 1, width, pixel.u, frame.width, pixel.v, frame.height};
  const LineInImage column{centre, width, 1, pixel.v, frame.height, pixel.u, frame.width};
  return static_cast<PixelLinks>((areLinked(row, limits) ? kLinkRight : 0) |
                                 (areLinked(column, limits) ? kLinkDown : 0));
}

}  // namespace dtsdf
