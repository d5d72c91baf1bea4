/// Computes surface normals from a depth image by plane fits in inverse depth that end at depth
/// edges.
///
/// The inverse depth of a plane n^T P = delta, with P = z ((u - cx) / fx, (v - cy) / fy, 1), is
/// affine in the pixel:
///   1 / z = (n_x (u - cx) / fx + n_y (v - cy) / fy + n_z) / delta.
/// So a fit of its value and slopes in a window around a pixel gives the normal without bias. The
/// noise of triangulating sensors is uniform in 1 / z. The least-squares fit over a rectangle
/// separates into a fit along the row and one along the column.
///
/// A strip one pixel wide (a rod, a wire, or a surface visible through a slit) has only one of the
/// two fits. If the fitted line is long enough and the strip is isolated, it is assumed to face the
/// camera across its width.
#pragma once

#include "kernels/surfels/line_fit.h"

namespace dtsdf {

/// Unit normal, facing the camera, of the plane with this value and slopes of 1 / z at (u, v); zero
/// if the value and both slopes are 0.
DTSDF_HD Vec3f planeNormal(float u, float v, float value, float slope_u, float slope_v,
                           const Intrinsics& K) {
  const Vec3f n{-(K.fx * slope_u), -(K.fy * slope_v),
                (u - K.cx) * slope_u + (v - K.cy) * slope_v - value};
  const float length = norm(n);
  if (!(length > 0.0f)) return {0.0f, 0.0f, 0.0f};
  return (1.0f / length) * n;
}

/// The plane of the surface at a pixel.
struct PixelPlane {
  Vec3f normal_C;          ///< Unit vector, facing the camera; zero if there is no plane.
  float slope_u, slope_v;  ///< Slopes of inverse depth, per pixel.
  float trust;             ///< Factor for the surfel's weight.
};

DTSDF_HD PixelPlane noPlane() { return {{0.0f, 0.0f, 0.0f}, 0.0f, 0.0f, 0.0f}; }

DTSDF_HD PixelPlane makePixelPlane(const Pixel& pixel, float value, float slope_u, float slope_v,
                                   const Intrinsics& K, float trust) {
  return {planeNormal(static_cast<float>(pixel.u), static_cast<float>(pixel.v), value, slope_u,
                      slope_v, K),
          slope_u, slope_v, trust};
}

/// The fit down a pixel's column through the values of the row fits, with their slopes as second
/// values; the count is 0 if there is no fit.
DTSDF_HD LineFit fitColumn(const FrameSensing& sensing, const Pixel& pixel,
                           const SurfelSettings& surfels) {
  const FrameView& frame = sensing.image.frame;
  const int64_t at = pixelIndex(frame, pixel);
  const float* centre = sensing.image.row_value + at;
  if (!(*centre > 0.0f)) return noFit();
  const WindowRadius radius = windowRadius(*centre, fitWindow(frame, sensing.noise, surfels));
  return fitLine({centre, sensing.image.row_slope + at, sensing.image.links + at},
                 columnAround(pixel.v, frame, radius));
}

/// Whether a pixel is in front of both adjacent pixels (or equally near), or behind both, like a
/// surface visible through a slit; both must be measured. Other pixels may mix the two sides of a
/// step, or belong to a floor at a grazing angle.
DTSDF_HD bool isDepthExtremum(float before, float inverse_depth, float after) {
  return before > 0.0f && after > 0.0f && (before > inverse_depth) == (after > inverse_depth);
}

/// isDepthExtremum() for the neighbours in the column (`across_rows`) or in the row.
DTSDF_HD bool isDepthExtremumAcross(const ImageView& image, const Pixel& pixel, bool across_rows) {
  const FrameView& frame = image.frame;
  const float* centre = image.inverse_depth + pixelIndex(frame, pixel);
  const int at = across_rows ? pixel.v : pixel.u;
  const int last = (across_rows ? frame.height : frame.width) - 1;
  const int64_t step = across_rows ? frame.width : 1;
  return isDepthExtremum(at > 0 ? centre[-step] : 0.0f, *centre, at < last ? centre[step] : 0.0f);
}

/// Any two pixels form a line; a third confirms it.
constexpr int32_t kMinLinePixels = 3;

/// The plane of a strip one pixel wide, along the row or down the column, with reduced weight;
/// noPlane() if the strip is short or not isolated.
DTSDF_HD PixelPlane stripPlane(const FrameSensing& sensing, const Pixel& pixel, bool along_row,
                               const SurfelSettings& surfels) {
  const FrameView& frame = sensing.image.frame;
  const int64_t at = pixelIndex(frame, pixel);
  const float* centre = sensing.image.inverse_depth + at;
  WindowRadius radius = windowRadius(*centre, fitWindow(frame, sensing.noise, surfels));
  radius.one_side = radius.both;  // a strip has few pixels, so its sides may differ
  const PixelLine line =
      along_row ? rowAround(pixel.u, frame.width, radius) : columnAround(pixel.v, frame, radius);
  const LineFit fit = fitLine({centre, centre, sensing.image.links + at}, line);
  if (fit.count < kMinLinePixels || !isDepthExtremumAcross(sensing.image, pixel, along_row)) {
    return noPlane();
  }
  return makePixelPlane(pixel, fit.value, along_row ? fit.slope : 0.0f,
                        along_row ? 0.0f : fit.slope, frame.intrinsics, surfels.rules.strip_weight);
}

/// The plane at a measured pixel, given the fit down its column; stripPlane() if one of the fits is
/// missing.
DTSDF_HD PixelPlane pixelPlane(const FrameSensing& sensing, const Pixel& pixel,
                               const LineFit& column, const SurfelSettings& surfels) {
  const FrameView& frame = sensing.image.frame;
  const bool has_row = sensing.image.row_value[pixelIndex(frame, pixel)] > 0.0f;
  if (!has_row || column.count < 2) return stripPlane(sensing, pixel, has_row, surfels);
  return makePixelPlane(pixel, column.value, column.mean_second, column.slope, frame.intrinsics,
                        1.0f);
}

/// Whether a pixel and the next in its row are linked and have row fits.
DTSDF_HD bool hasRowBetween(const ImageView& image, int64_t at) {
  return image.row_value[at] > 0.0f && image.row_value[at + 1] > 0.0f &&
         (image.links[at] & kLinkRight) != 0;
}

/// The normal at the point between the four pixels from (u, v) to (u + 1, v + 1); zero if there is
/// none. The line down the column is fitted to the means of each row's two fits.
DTSDF_HD Vec3f fitNormalBetween(const FrameSensing& sensing, const Pixel& pixel,
                                const SurfelSettings& surfels) {
  const ImageView& image = sensing.image;
  const int64_t first = pixelIndex(image.frame, pixel), stride = image.frame.width;
  const float origin = image.row_value[first];
  if (!(origin > 0.0f)) return {0.0f, 0.0f, 0.0f};
  const WindowRadius radius = windowRadius(origin, fitWindow(image.frame, sensing.noise, surfels));
  const int rows_above = pixel.v + 1, rows_below = image.frame.height - 1 - pixel.v;
  // Sums of a line fit with samples at any offsets, and of slopes along the rows.
  float n = 0.0f, k = 0.0f, kk = 0.0f, y = 0.0f, ky = 0.0f, slopes = 0.0f;
  const auto addRowBetween = [&](int64_t at, float offset) {
    const float left = image.row_value[at], right = image.row_value[at + 1];
    const float mean = 0.5f * ((left - origin) + (right - origin));
    n += 1.0f;
    k += offset;
    kk += offset * offset;
    y += mean;
    ky += offset * mean;
    slopes += 0.5f * (image.row_slope[at] + image.row_slope[at + 1]);
  };
  bool above = true, below = true;
  for (int row = 0; row < radius.both && (above || below); ++row) {
    const int64_t up = first - row * stride, down = first + (row + 1) * stride;
    above = above && row < rows_above && (row == 0 || (image.links[up] & kLinkDown) != 0) &&
            hasRowBetween(image, up);
    below = below && row < rows_below && (image.links[down - stride] & kLinkDown) != 0 &&
            hasRowBetween(image, down);
    if (row >= radius.one_side && !(above && below)) break;
    const float offset = static_cast<float>(row) + 0.5f;
    if (above) addRowBetween(up, -offset);
    if (below) addRowBetween(down, offset);
  }
  if (n < 2.0f) return {0.0f, 0.0f, 0.0f};
  const float slope = (n * ky - k * y) / (n * kk - k * k);
  return planeNormal(static_cast<float>(pixel.u) + 0.5f, static_cast<float>(pixel.v) + 0.5f,
                     origin + (y - slope * k) / n, slopes / n, slope, image.frame.intrinsics);
}

}  // namespace dtsdf
