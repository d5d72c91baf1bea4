/// A measured surface point with its normal and weight: what fusion knows of a pixel, of merged
/// pixels, or of a subpixel.
#pragma once

#include "kernels/surfels/pixel_merging.h"
#include "kernels/surfels/pixel_subdivision.h"

namespace dtsdf {

/// Point and unit normal in the frame's local frame L, in voxels. Weight 0: no measurement.
struct Surfel {
  Vec3f p_L;
  float weight;
  Vec3f normal_L;
  float depth_m;
  Footprint footprint_px = {0.0f, 0.0f};
};

/// Share of a voxel's face that a pixel covers at a depth, seen face on: so that what a frame says
/// of a voxel does not depend on how many pixels it took to say it.
DTSDF_HD float coveredShare(const FrameView& frame, float depth_m) {
  const float width = depth_m / (frame.intrinsics.fx * frame.voxel_size_m);
  return width * width;
}

/// Angle weight: cosine between the view ray and the normal (paper, Sec. IV-A).
DTSDF_HD float angleWeight(const Vec3f& p_C, const Vec3f& normal_C) {
  const float cosine = -dot(p_C, normal_C) / norm(p_C);
  return cosine > 0.0f ? cosine : 0.0f;
}

DTSDF_HD Surfel noSurfel() { return {{0.0f, 0.0f, 0.0f}, 0.0f, {0.0f, 0.0f, 0.0f}, 0.0f}; }

/// A point in the image, in pixels from the centre of the first one, and its depth.
struct ImagePoint {
  float u, v, depth_m;
};

/// What is seen of a surfel: its point, the normal there, in the camera's frame, how much of a
/// voxel it covers, and its footprint.
struct SeenSurfel {
  ImagePoint point;
  Vec3f normal_C;
  float share;
  Footprint footprint_px = {0.0f, 0.0f};
};

DTSDF_HD Surfel makeSurfel(const FrameView& frame, const SeenSurfel& seen) {
  const auto& [u, v, depth_m] = seen.point;
  if (!(dot(seen.normal_C, seen.normal_C) > 0.0f)) return noSurfel();
  const Vec3f p_C = backProject(frame.intrinsics, u, v, depth_m);
  const Vec3f p_voxels = (1.0f / frame.voxel_size_m) * p_C;
  return {transform(frame.T_L_C, p_voxels), seen.share * angleWeight(p_C, seen.normal_C),
          rotate(frame.T_L_C, seen.normal_C), depth_m, seen.footprint_px};
}

/// A measurement without a normal: all that the undirected map needs for voxel projection.
DTSDF_HD Surfel makePointSurfel(const ImageView& image, const Pixel& pixel) {
  const FrameView& frame = image.frame;
  const float inverse_depth = image.inverse_depth[pixelIndex(frame, pixel)];
  if (!(inverse_depth > 0.0f)) return noSurfel();
  const float depth_m = 1.0f / inverse_depth;
  const Vec3f p_C = backProject(frame.intrinsics, static_cast<float>(pixel.u),
                                static_cast<float>(pixel.v), depth_m);
  return {
      transform(frame.T_L_C, (1.0f / frame.voxel_size_m) * p_C), 1.0f, {0.0f, 0.0f, 0.0f}, depth_m};
}

/// A measured pixel, ready to become a surfel, or several.
struct PixelMeasurement {
  Pixel pixel;
  PixelPlane plane;
  Subdivision subdivision;
};

/// A pixel in one piece, without a plane where it is not measured, given the fit along its column.
DTSDF_HD PixelMeasurement wholePixel(const FrameSensing& sensing, const Pixel& pixel,
                                     const LineFit& column, const SurfelSettings& surfels) {
  const ImageView& image = sensing.image;
  const bool is_measured = image.inverse_depth[pixelIndex(image.frame, pixel)] > 0.0f;
  return {pixel, is_measured ? pixelPlane(sensing, pixel, column, surfels) : noPlane(), {1, 1}};
}

/// The same, subdivided where it is wide.
DTSDF_HD PixelMeasurement subdividedPixel(const FrameSensing& sensing, const Pixel& pixel,
                                          const LineFit& column, const SurfelSettings& surfels) {
  PixelMeasurement measured = wholePixel(sensing, pixel, column, surfels);
  if (measured.plane.trust > 0.0f) {
    measured.subdivision = subdividePixel(sensing, pixel, measured.plane, surfels);
  }
  return measured;
}

/// What is seen of a subpixel; number 0 of a pixel in one piece is the pixel.
DTSDF_HD SeenSurfel seenSubpixel(const ImageView& image, const PixelMeasurement& measured,
                                 int subpixel) {
  const SubpixelOffset offset = subpixelOffset(measured.subdivision, subpixel);
  const float inverse_depth = inverseDepthBeside(image, measured.pixel, measured.plane, offset);
  const ImagePoint point{static_cast<float>(measured.pixel.u) + offset.u,
                         static_cast<float>(measured.pixel.v) + offset.v, 1.0f / inverse_depth};
  const float count = static_cast<float>(subpixelCount(measured.subdivision));
  const float share = minimum(coveredShare(image.frame, point.depth_m) / count, 1.0f);
  return {point, measured.plane.normal_C, share * measured.plane.trust,
          measured.subdivision.footprint_px};
}

DTSDF_HD Surfel makeSubpixelSurfel(const ImageView& image, const PixelMeasurement& measured,
                                   int subpixel) {
  return makeSurfel(image.frame, seenSubpixel(image, measured, subpixel));
}

/// The surfel of a pixel for voxel projection, where each voxel takes one pixel and no more.
DTSDF_HD Surfel makeWholePixelSurfel(const ImageView& image, const PixelMeasurement& measured) {
  const float inverse_depth = image.inverse_depth[pixelIndex(image.frame, measured.pixel)];
  const ImagePoint point{static_cast<float>(measured.pixel.u), static_cast<float>(measured.pixel.v),
                         1.0f / inverse_depth};
  return makeSurfel(image.frame, {point, measured.plane.normal_C, measured.plane.trust});
}

/// The one surfel of a pixel that is neither merged nor subdivided.
DTSDF_HD Surfel makePixelSurfel(const FrameSensing& sensing, const Pixel& pixel,
                                const SurfelSettings& surfels) {
  if (surfels.normal_radius_px == 0) return makePointSurfel(sensing.image, pixel);
  const LineFit column = fitColumn(sensing, pixel, surfels);
  return makeWholePixelSurfel(sensing.image, wholePixel(sensing, pixel, column, surfels));
}

/// What is seen of merged pixels. The mean of 1 / z is that of a plane at the square's centre.
DTSDF_HD SeenSurfel seenSquare(const FrameSensing& sensing, const PixelSquare& square,
                               const SurfelSettings& surfels) {
  const ImageView& image = sensing.image;
  const float* row = image.inverse_depth + pixelIndex(image.frame, square.first);
  float sum = 0.0f;
  for (int y = 0; y < square.side; ++y, row += image.frame.width) {
    for (int x = 0; x < square.side; ++x) sum += row[x];
  }
  const float pixels = static_cast<float>(square.side * square.side);
  const float to_centre = 0.5f * static_cast<float>(square.side - 1);
  const int half = square.side / 2 - 1;
  const Vec3f normal_C =
      fitNormalBetween(sensing, {square.first.u + half, square.first.v + half}, surfels);
  const ImagePoint centre{static_cast<float>(square.first.u) + to_centre,
                          static_cast<float>(square.first.v) + to_centre, pixels / sum};
  const float share = minimum(pixels * coveredShare(image.frame, centre.depth_m), 1.0f);
  return {centre, normal_C, share};
}

DTSDF_HD Surfel makeMergedSurfel(const FrameSensing& sensing, const PixelSquare& square,
                                 const SurfelSettings& surfels) {
  return makeSurfel(sensing.image.frame, seenSquare(sensing, square, surfels));
}

}  // namespace dtsdf
