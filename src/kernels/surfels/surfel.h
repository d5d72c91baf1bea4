/// A measured surface point with its normal and weight: what fusion knows of a pixel, of a group of
/// pixels, or of a part of one.
#pragma once

#include "kernels/surfels/pixel_group.h"
#include "kernels/surfels/pixel_parts.h"

namespace dtsdf {

/// Point and unit normal in the frame's local frame L, in voxels. Weight 0: no measurement.
struct Surfel {
  Vec3f p_L;
  float weight;
  Vec3f normal_L;
  float depth_m;
};

/// Depth weight: the noise of triangulating depth cameras grows with z^2, and a weight is the
/// inverse of a standard deviation, so min(1, (1 m / z)^2). (The authors' later work uses the same
/// shape with the sensor's nearest depth in place of 1 m.)
DTSDF_HD float depthWeight(float depth_m) {
  return depth_m <= 1.0f ? 1.0f : 1.0f / (depth_m * depth_m);
}

/// Angle weight: cosine between the view ray and the normal (paper, Sec. IV-A).
DTSDF_HD float angleWeight(const Vec3f& p_C, const Vec3f& normal_C) {
  const float cosine = -dot(p_C, normal_C) / norm(p_C);
  return cosine > 0.0f ? cosine : 0.0f;
}

DTSDF_HD Surfel noSurfel() { return {{0.0f, 0.0f, 0.0f}, 0.0f, {0.0f, 0.0f, 0.0f}, 0.0f}; }

/// The surfel of `pixels` pixels with their centre at (u, v).
DTSDF_HD Surfel makeSurfel(const FrameView& frame, float u, float v, float depth_m,
                           const Vec3f& normal_C, float pixels) {
  if (!(dot(normal_C, normal_C) > 0.0f)) return noSurfel();
  const Vec3f p_C = backProject(frame.intrinsics, u, v, depth_m);
  const Vec3f p_voxels = (1.0f / frame.voxel_size_m) * p_C;
  return {transform(frame.T_L_C, p_voxels),
          pixels * (depthWeight(depth_m) * angleWeight(p_C, normal_C)),
          rotate(frame.T_L_C, normal_C), depth_m};
}

/// A measurement without a normal: all that the undirected map needs for voxel projection.
DTSDF_HD Surfel makePoint(const FrameView& frame, int u, int v, float inverse_depth) {
  if (!(inverse_depth > 0.0f)) return noSurfel();
  const float depth_m = 1.0f / inverse_depth;
  const Vec3f p_C = backProject(frame.intrinsics, static_cast<float>(u), static_cast<float>(v),
                                depth_m);
  return {transform(frame.T_L_C, (1.0f / frame.voxel_size_m) * p_C), depthWeight(depth_m),
          {0.0f, 0.0f, 0.0f}, depth_m};
}

/// A measured pixel, ready to become a surfel, or several.
struct PixelMeasurement {
  int32_t u, v;
  PixelPlane plane;
  PixelParts parts;
};

/// A pixel in one part, without a normal where it is not measured, given the fit along its column.
DTSDF_HD PixelMeasurement wholePixel(const FrameView& frame, const FitImages& images, int u, int v,
                                     const LineFit& column, const NormalFitSettings& settings) {
  PixelMeasurement pixel{u, v, {{0.0f, 0.0f, 0.0f}, 0.0f, 0.0f, 0.0f}, {1, 1}};
  if (images.inverse_depth[static_cast<int64_t>(v) * frame.width + u] > 0.0f) {
    pixel.plane = pixelPlane(images, frame.width, frame.height, u, v, column, frame.intrinsics,
                             settings);
  }
  return pixel;
}

/// The same, divided where it is wide.
DTSDF_HD PixelMeasurement dividedPixel(const FrameView& frame, const FitImages& images, int u,
                                       int v, const LineFit& column,
                                       const NormalFitSettings& settings) {
  PixelMeasurement pixel = wholePixel(frame, images, u, v, column, settings);
  if (pixel.plane.trust > 0.0f) {
    pixel.parts = dividePixel(frame, images, u, v, pixel.plane, settings.depth_jump);
  }
  return pixel;
}

/// The surfel of a part of a pixel.
DTSDF_HD Surfel makePartSurfel(const FrameView& frame, const FitImages& images,
                               const PixelMeasurement& pixel, int part) {
  const PartOffset offset = partOffset(pixel.parts, part);
  const float inverse_depth =
      inverseDepthBeside(images, frame.width, pixel.u, pixel.v, pixel.plane, offset);
  return makeSurfel(frame, static_cast<float>(pixel.u) + offset.u,
                    static_cast<float>(pixel.v) + offset.v, 1.0f / inverse_depth,
                    pixel.plane.normal_C,
                    pixel.plane.trust / static_cast<float>(partCount(pixel.parts)));
}

/// The one surfel of a whole pixel.
DTSDF_HD Surfel computeSurfel(const FrameView& frame, const FitImages& images, int u, int v,
                              const NormalFitSettings& settings) {
  if (settings.radius_px == 0) {
    return makePoint(frame, u, v, images.inverse_depth[static_cast<int64_t>(v) * frame.width + u]);
  }
  const LineFit column = fitColumn(images, frame.width, frame.height, u, v, settings);
  return makePartSurfel(frame, images, wholePixel(frame, images, u, v, column, settings), 0);
}

/// The surfel of a group of side x side pixels with its first corner at (u, v). The mean of 1 / z is
/// that of a plane at the group's centre.
DTSDF_HD Surfel computeGroupSurfel(const FrameView& frame, const FitImages& images, int u, int v,
                                   int side, const NormalFitSettings& settings) {
  float sum = 0.0f;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      sum += images.inverse_depth[static_cast<int64_t>(v + y) * frame.width + u + x];
    }
  }
  const float pixels = static_cast<float>(side * side);
  const float to_centre = 0.5f * static_cast<float>(side - 1);
  const int half = side / 2 - 1;
  const Vec3f normal_C = fitNormalBetween(images.row_value, images.row_slope, frame.width,
                                          frame.height, u + half, v + half, frame.intrinsics,
                                          settings);
  return makeSurfel(frame, static_cast<float>(u) + to_centre, static_cast<float>(v) + to_centre,
                    pixels / sum, normal_C, pixels);
}

}  // namespace dtsdf
