/// Surface normals from a depth image, by edge-stopped plane fits in inverse depth.
///
/// The inverse depth of a plane is an affine function of the pixel: with n^T P = delta and
/// P = z ((u - cx) / fx, (v - cy) / fy, 1),
///   1 / z = (n_x (u - cx) / fx + n_y (v - cy) / fy + n_z) / delta.
/// Fitting value and slopes of 1 / z in a window around a pixel therefore gives the normal of a
/// plane without bias, and the noise of triangulating sensors is uniform in this quantity. The
/// least-squares fit over a rectangle separates into a fit along the row and one along the column.
/// Each walk ends where neighbouring depths jump, so that nothing is mixed across a discontinuity.
///
/// In a strip that is a single pixel wide only one of the two fits is there: a rod, a wire, or what
/// shows through a slit. If that line is long enough, the strip counts as facing the camera across it.
#pragma once

#include "kernels/core/camera.h"

namespace dtsdf {

/// The images that surfels are made from, row by row without gaps.
struct FitImages {
  const float* inverse_depth;  ///< In 1/m, 0 where nothing is measured.
  const float* row_value;      ///< Of the row fits.
  const float* row_slope;
};

struct NormalFitSettings {
  int32_t radius_px;  ///< Largest half width of the window; 0 where no normals are needed.
  float depth_jump;   ///< Largest share by which neighbouring depths on one surface may differ.
  float voxel_px_m;   ///< Width of a voxel in pixels at 1 m: focal length times voxel size.
  float focal_px;
  float noise;        ///< Standard deviation of the image's inverse depth, in 1/m.
};

/// Noise turns a normal by about this many radians at most, as far as the window may grow.
constexpr float kLargestTurn = 0.15f;

/// The least window that keeps noise below kLargestTurn. The slope of a plane fitted over a square
/// window of half width r has the standard deviation of a sample divided by sqrt(sum of k^2), which
/// is 1.155 (r + 1/2)^2; times focal length and depth this is an angle.
DTSDF_HD float noiseRadius(float inverse_depth, const NormalFitSettings& settings) {
  return sqrtf(settings.noise * settings.focal_px / (1.155f * kLargestTurn * inverse_depth));
}

/// The window spans one and a half voxels: finer detail is lost in the map anyhow, and more samples
/// mean less noise.
DTSDF_HD int windowRadius(float inverse_depth, const NormalFitSettings& settings) {
  constexpr float kVoxelsToEachSide = 0.75f, kLeastRadius = 2.0f;
  const float radius =
      maximum(maximum(kVoxelsToEachSide * settings.voxel_px_m * inverse_depth, kLeastRadius),
              noiseRadius(inverse_depth, settings));
  const float largest = static_cast<float>(settings.radius_px);
  return static_cast<int>(minimum(radius, largest) + 0.5f);
}

/// A straight line through samples of inverse depth, at the centre of the walk.
struct LineFit {
  float value;
  float slope;  ///< Per pixel.
  float mean_attached;  ///< Mean of the attached samples over the walk.
  int32_t count;        ///< Samples used, the centre included; a slope needs two.
};

/// Inverse depths that differ by no more than this, in 1/m, may lie on one surface: five standard
/// deviations of the difference of two measurements by a Kinect (noise of 1.9 mm at 1 m, growing with
/// z^2). Beyond 2 m, where noise and slant reach the share `depth_jump`, this limit rules.
constexpr float kNoiseLimit = 0.015f;

DTSDF_HD bool depthsConnected(float a, float b, float depth_jump) {
  return fabsf(b - a) <= maximum(depth_jump * maximum(a, b), kNoiseLimit);
}

/// Takes the sample at offset k, `step` steps from the centre, unless the walk ends at it: beyond
/// `radius`, without a measurement, or at a jump. Branch-free, so that the CPU can walk from
/// several pixels at once.
DTSDF_HD void takeSample(float step, float radius, float k, float previous, float current, float y,
                         float attached, float depth_jump, int32_t& open, float& steps,
                         float& sum_y, float& sum_ky, float& sum_attached) {
  open &= static_cast<int32_t>(step <= radius) & static_cast<int32_t>(current > 0.0f) &
          static_cast<int32_t>(depthsConnected(previous, current, depth_jump));
  const float taken = static_cast<float>(open);
  steps += taken;
  sum_y += taken * y;
  sum_ky += taken * (k * y);
  sum_attached += taken * attached;
}

/// The line through the samples at offsets -before..after; `y` is relative to `origin`.
DTSDF_HD LineFit finishLine(float origin, float before, float after, float sum_y, float sum_ky,
                            float sum_attached) {
  const float n = 1.0f + before + after;
  const float sum_k = 0.5f * (after * (after + 1.0f) - before * (before + 1.0f));
  const float sum_kk = (after * (after + 1.0f) * (2.0f * after + 1.0f) +
                        before * (before + 1.0f) * (2.0f * before + 1.0f)) / 6.0f;
  const float spread = n * sum_kk - sum_k * sum_k;
  const float slope = (n * sum_ky - sum_k * sum_y) / (n > 1.0f ? spread : 1.0f);
  const float value = origin + (sum_y - slope * sum_k) / n;
  return {value, slope, sum_attached / n, static_cast<int32_t>(n)};
}

/// Fits a line to `values` at offsets -before..after around `centre`, ending at invalid samples and
/// jumps of `inverse_depth`. `attached` is averaged over the same samples.
DTSDF_HD LineFit fitLine(const float* inverse_depth, const float* values, const float* attached,
                         int64_t centre, int64_t stride, int before, int after, float depth_jump) {
  const float origin = values[centre];
  float sum_y = 0.0f, sum_ky = 0.0f, sum_attached = attached[centre];
  float taken[2] = {0.0f, 0.0f};
  for (int side = 0; side < 2; ++side) {
    const int steps = side == 0 ? before : after;
    float previous = inverse_depth[centre];
    int32_t open = 1;
    for (int step = 1; step <= steps && open != 0; ++step) {
      const int k = side == 0 ? -step : step;
      const int64_t at = centre + k * stride;
      const float current = inverse_depth[at];
      takeSample(1.0f, 1.0f, static_cast<float>(k), previous, current, values[at] - origin,
                 attached[at], depth_jump, open, taken[side], sum_y, sum_ky, sum_attached);
      previous = current;
    }
  }
  return finishLine(origin, taken[0], taken[1], sum_y, sum_ky, sum_attached);
}

/// What the row pass leaves for the column pass, one image each.
struct RowFit {
  float value;  ///< Fitted inverse depth; 0 where there is none, or no slope.
  float slope;
};

DTSDF_HD RowFit rowFitOf(const LineFit& fit) {
  return fit.count < 2 ? RowFit{0.0f, 0.0f} : RowFit{fit.value, fit.slope};
}

DTSDF_HD RowFit fitRow(const float* inverse_depth, int width, int u, int v,
                       const NormalFitSettings& settings) {
  const int64_t centre = static_cast<int64_t>(v) * width + u;
  if (!(inverse_depth[centre] > 0.0f)) return {0.0f, 0.0f};
  const int radius = windowRadius(inverse_depth[centre], settings);
  const int before = u < radius ? u : radius;
  const int after = width - 1 - u < radius ? width - 1 - u : radius;
  const LineFit fit = fitLine(inverse_depth, inverse_depth, inverse_depth, centre, 1, before, after,
                              settings.depth_jump);
  return rowFitOf(fit);
}

/// The unit normal of the plane with the given 1 / z and slopes of it at (u, v), facing the camera;
/// zero where there is none.
DTSDF_HD Vec3f planeNormal(float u, float v, float value, float du, float dv,
                           const Intrinsics& K) {
  const Vec3f n{-(K.fx * du), -(K.fy * dv), (u - K.cx) * du + (v - K.cy) * dv - value};
  const float length = norm(n);
  if (!(length > 0.0f)) return {0.0f, 0.0f, 0.0f};
  return (1.0f / length) * n;
}

/// The plane that stands for the surface at a pixel.
struct PixelPlane {
  Vec3f normal_C;          ///< Unit, facing the camera; zero: there is none.
  float slope_u, slope_v;  ///< Of its inverse depth, per pixel.
  float trust;             ///< Share of the weight that it deserves.
};

/// The fit along a pixel's column, through the values of the row fits; count 0 if it has none.
DTSDF_HD LineFit fitColumn(const FitImages& images, int width, int height, int u, int v,
                           const NormalFitSettings& settings) {
  const int64_t centre = static_cast<int64_t>(v) * width + u;
  if (!(images.row_value[centre] > 0.0f)) return {0.0f, 0.0f, 0.0f, 0};
  const int radius = windowRadius(images.row_value[centre], settings);
  const int before = v < radius ? v : radius;
  const int after = height - 1 - v < radius ? height - 1 - v : radius;
  return fitLine(images.row_value, images.row_value, images.row_slope, centre, width, before, after,
                 settings.depth_jump);
}

/// A normal that rests on a single line of pixels needs this many of them, and counts for so much:
/// enough where nothing else was measured, too little to disturb what was.
constexpr int kLeastLine = 3;
constexpr float kLineTrust = 0.05f;

/// Whether a pixel is measured in front of the two beside it, or behind both, as through a slit. In
/// between lie pixels that mix the two sides of a step, and rows of a floor that is seen at too flat
/// an angle; beside pixels without a measurement (0) there is no telling.
DTSDF_HD bool standsAlone(float before, float inverse_depth, float after) {
  return before > 0.0f && after > 0.0f && (before > inverse_depth) == (after > inverse_depth);
}

/// The plane of a strip one pixel wide, along the row or down the column; across it, it faces the
/// camera.
DTSDF_HD PixelPlane stripPlane(const FitImages& images, int width, int height, int u, int v,
                               bool along_row, const Intrinsics& K,
                               const NormalFitSettings& settings) {
  const int64_t centre = static_cast<int64_t>(v) * width + u;
  const int radius = windowRadius(images.inverse_depth[centre], settings);
  const int at = along_row ? u : v, last = (along_row ? width : height) - 1;
  const int before = at < radius ? at : radius;
  const int after = last - at < radius ? last - at : radius;
  const float* values = images.inverse_depth;
  const LineFit fit = fitLine(values, values, values, centre, along_row ? 1 : width, before, after,
                              settings.depth_jump);
  const int across = along_row ? v : u, last_across = (along_row ? height : width) - 1;
  const int64_t step = along_row ? width : 1;
  const float beside[2] = {across > 0 ? values[centre - step] : 0.0f,
                           across < last_across ? values[centre + step] : 0.0f};
  if (fit.count < kLeastLine || !standsAlone(beside[0], values[centre], beside[1])) {
    return {{0.0f, 0.0f, 0.0f}, 0.0f, 0.0f, 0.0f};
  }
  const float slope_u = along_row ? fit.slope : 0.0f, slope_v = along_row ? 0.0f : fit.slope;
  return {planeNormal(static_cast<float>(u), static_cast<float>(v), fit.value, slope_u, slope_v, K),
          slope_u, slope_v, kLineTrust};
}

/// The plane at a measured pixel, given the fit along its column.
DTSDF_HD PixelPlane pixelPlane(const FitImages& images, int width, int height, int u, int v,
                               const LineFit& column, const Intrinsics& K,
                               const NormalFitSettings& settings) {
  const bool has_row = images.row_value[static_cast<int64_t>(v) * width + u] > 0.0f;
  if (!has_row || column.count < 2) {
    return stripPlane(images, width, height, u, v, has_row, K, settings);
  }
  return {planeNormal(static_cast<float>(u), static_cast<float>(v), column.value,
                      column.mean_attached, column.slope, K),
          column.mean_attached, column.slope, 1.0f};
}

/// The normal at the point between the four pixels from (u, v) to (u + 1, v + 1): along the column
/// between the two that the pixels lie on, whose row fits are averaged. Zero where there is none.
DTSDF_HD Vec3f fitNormalBetween(const float* row_value, const float* row_slope, int width,
                                int height, int u, int v, const Intrinsics& K,
                                const NormalFitSettings& settings) {
  const int64_t first = static_cast<int64_t>(v) * width + u;
  const float origin = row_value[first];
  if (!(origin > 0.0f)) return {0.0f, 0.0f, 0.0f};
  const int radius = windowRadius(origin, settings);
  const int before = v + 1 < radius ? v + 1 : radius;
  const int after = height - 1 - v < radius ? height - 1 - v : radius;
  float n = 0.0f, sum_k = 0.0f, sum_kk = 0.0f, sum_y = 0.0f, sum_ky = 0.0f, sum_slope = 0.0f;
  for (int side = 0; side < 2; ++side) {
    const int steps = side == 0 ? before : after;
    float previous = origin;
    for (int step = 0; step < steps; ++step) {
      const int64_t at = first + static_cast<int64_t>(side == 0 ? -step : step + 1) * width;
      const float left = row_value[at], right = row_value[at + 1];
      if (!(left > 0.0f && right > 0.0f) || !depthsConnected(left, right, settings.depth_jump) ||
          !depthsConnected(previous, left, settings.depth_jump)) {
        break;
      }
      previous = left;
      const float k = static_cast<float>(step) + 0.5f, offset = side == 0 ? -k : k;
      const float y = 0.5f * ((left - origin) + (right - origin));
      n += 1.0f;
      sum_k += offset;
      sum_kk += k * k;
      sum_y += y;
      sum_ky += offset * y;
      sum_slope += 0.5f * (row_slope[at] + row_slope[at + 1]);
    }
  }
  if (n < 2.0f) return {0.0f, 0.0f, 0.0f};
  const float slope = (n * sum_ky - sum_k * sum_y) / (n * sum_kk - sum_k * sum_k);
  const float value = origin + (sum_y - slope * sum_k) / n;
  return planeNormal(static_cast<float>(u) + 0.5f, static_cast<float>(v) + 0.5f, value,
                     sum_slope / n, slope, K);
}

}  // namespace dtsdf
