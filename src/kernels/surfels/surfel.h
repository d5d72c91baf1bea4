/// A surfel: a measured surface point with its normal and weight, from a pixel, from merged pixels,
/// or from a subpixel.
#pragma once

#include "kernels/surfels/pixel_merging.h"
#include "kernels/surfels/pixel_subdivision.h"

namespace dtsdf {

/// A point, in voxels, and its unit normal (0 if there is none) in the local frame L. The weight is
/// 0 if there is no surfel.
struct Surfel {
  Vec3f p_L;
  float weight;
  Vec3f normal_L;
  float depth_m;
  /// Distances along the image's rows and columns up to which the surface is known to continue on
  /// both sides of the point; see Subdivision.
  float half_across_px = 0.0f, half_down_px = 0.0f;
};

/// Fraction of a voxel's face that a pixel covers at a depth, if the surface faces the camera; may
/// exceed 1. As a weight, it makes a frame's effect independent of the image's resolution.
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

/// The surfel at a point (u, v) of the image, in pixels relative to the centre of the first pixel.
/// It covers the fraction `share` of a voxel's face.
DTSDF_HD Surfel makeSurfel(const FrameView& frame, float u, float v, float depth_m,
                           const Vec3f& normal_C, float share, float half_across_px = 0.0f,
                           float half_down_px = 0.0f) {
  if (!(dot(normal_C, normal_C) > 0.0f)) return noSurfel();
  const Vec3f p_C = backProject(frame.intrinsics, u, v, depth_m);
  const Vec3f p_voxels = (1.0f / frame.voxel_size_m) * p_C;
  return {transform(frame.T_L_C, p_voxels),
          share * angleWeight(p_C, normal_C),
          rotate(frame.T_L_C, normal_C),
          depth_m,
          half_across_px,
          half_down_px};
}

/// A surfel without a normal, for voxel projection into an undirected map.
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

/// A measured pixel, from which one or several surfels are computed.
struct PixelMeasurement {
  Pixel pixel;
  PixelPlane plane;
  Subdivision subdivision;
};

/// An undivided pixel, given the fit down its column. It has no plane if it is not measured.
DTSDF_HD PixelMeasurement wholePixel(const FrameSensing& sensing, const Pixel& pixel,
                                     const LineFit& column, const SurfelSettings& surfels) {
  const ImageView& image = sensing.image;
  const bool is_measured = image.inverse_depth[pixelIndex(image.frame, pixel)] > 0.0f;
  return {pixel, is_measured ? pixelPlane(sensing, pixel, column, surfels) : noPlane(), {1, 1}};
}

/// A pixel, subdivided if it is wide, given the fit down its column.
DTSDF_HD PixelMeasurement subdividedPixel(const FrameSensing& sensing, const Pixel& pixel,
                                          const LineFit& column, const SurfelSettings& surfels) {
  PixelMeasurement measured = wholePixel(sensing, pixel, column, surfels);
  if (measured.plane.trust > 0.0f) {
    measured.subdivision = subdividePixel(sensing, pixel, measured.plane, surfels);
  }
  return measured;
}

/// The surfel of a subpixel. Subpixel 0 of an undivided pixel is the whole pixel.
DTSDF_HD Surfel makeSubpixelSurfel(const ImageView& image, const PixelMeasurement& measured,
                                   int subpixel) {
  const auto& [pixel, plane, subdivision] = measured;
  const float du = subpixelOffset(subpixel % subdivision.across, subdivision.across);
  const float dv = subpixelOffset(subpixel / subdivision.across, subdivision.down);
  const float depth_m = 1.0f / inverseDepthBeside(image, pixel, plane, du, dv);
  const float count = static_cast<float>(subpixelCount(subdivision));
  const float share = minimum(coveredShare(image.frame, depth_m) / count, 1.0f);
  return makeSurfel(image.frame, static_cast<float>(pixel.u) + du, static_cast<float>(pixel.v) + dv,
                    depth_m, plane.normal_C, share * plane.trust, subdivision.half_across_px,
                    subdivision.half_down_px);
}

/// The surfel of a pixel for voxel projection, where each voxel uses only one pixel.
DTSDF_HD Surfel makeWholePixelSurfel(const ImageView& image, const PixelMeasurement& measured) {
  const auto& [u, v] = measured.pixel;
  const float depth_m = 1.0f / image.inverse_depth[pixelIndex(image.frame, measured.pixel)];
  return makeSurfel(image.frame, static_cast<float>(u), static_cast<float>(v), depth_m,
                    measured.plane.normal_C, measured.plane.trust);
}

/// The surfel of a pixel for voxel projection, with its normal if the map needs one.
DTSDF_HD Surfel makePixelSurfel(const FrameSensing& sensing, const Pixel& pixel,
                                const SurfelSettings& surfels) {
  if (surfels.normal_radius_px == 0) return makePointSurfel(sensing.image, pixel);
  const LineFit column = fitColumn(sensing, pixel, surfels);
  return makeWholePixelSurfel(sensing.image, wholePixel(sensing, pixel, column, surfels));
}

/// The surfel of merged pixels, at the square's centre. Its inverse depth is the mean over the
/// pixels, which for a plane equals the value at the centre.
DTSDF_HD Surfel makeMergedSurfel(const FrameSensing& sensing, const PixelSquare& square,
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
  const float depth_m = pixels / sum;
  const float share = minimum(pixels * coveredShare(image.frame, depth_m), 1.0f);
  return makeSurfel(image.frame, static_cast<float>(square.first.u) + to_centre,
                    static_cast<float>(square.first.v) + to_centre, depth_m, normal_C, share);
}

}  // namespace dtsdf
