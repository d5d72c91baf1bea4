/// Which pixels are fused as several surfels: the counterpart of pixel_group.h.
///
/// Far away, or at a grazing angle, a pixel covers more of the surface than a voxel. One surfel at
/// its centre would leave the voxels between neighbouring pixels without samples, and so holes. Such
/// a pixel is divided into thirds, along one axis of the image or both, which lie on its plane.
#pragma once

#include "kernels/surfels/normal_estimation.h"

namespace dtsdf {

/// Parts along the rows and along the columns of the image: 1 or kThirds.
struct PixelParts {
  int32_t across, down;
};

/// A surfel updates the samples to both sides of it, so thirds leave none out in a pixel as wide as
/// five voxels.
constexpr int kThirds = 3;
/// A pixel is divided along an axis if its neighbours to both sides lie no farther than this from its
/// plane, in voxels: one surface, not the step from one to another.
constexpr float kNeighbourDistance = 0.5f;

DTSDF_HD int partCount(const PixelParts& parts) {
  return parts.across * parts.down;
}

/// Whether the neighbour at (u, v) continues the surface of a pixel at `p_C` with this plane.
DTSDF_HD bool continuesPlane(const FrameView& frame, const FitImages& images, int u, int v,
                             const Vec3f& p_C, const PixelPlane& plane, float depth_jump) {
  if (u < 0 || v < 0 || u >= frame.width || v >= frame.height) return false;
  const float inverse_depth = images.inverse_depth[static_cast<int64_t>(v) * frame.width + u];
  if (!(inverse_depth > 0.0f) || !depthsConnected(1.0f / p_C.z, inverse_depth, depth_jump)) {
    return false;
  }
  const Vec3f neighbour_C = backProject(frame.intrinsics, static_cast<float>(u),
                                        static_cast<float>(v), 1.0f / inverse_depth);
  return fabsf(dot(plane.normal_C, neighbour_C - p_C)) <= kNeighbourDistance * frame.voxel_size_m;
}

/// The same for the neighbours to both sides, (du, dv) and (-du, -dv) away.
DTSDF_HD bool continuesToBothSides(const FrameView& frame, const FitImages& images, int u, int v,
                                   int du, int dv, const Vec3f& p_C, const PixelPlane& plane,
                                   float depth_jump) {
  return continuesPlane(frame, images, u - du, v - dv, p_C, plane, depth_jump) &&
         continuesPlane(frame, images, u + du, v + dv, p_C, plane, depth_jump);
}

/// How a measured pixel is divided.
DTSDF_HD PixelParts dividePixel(const FrameView& frame, const FitImages& images, int u, int v,
                                const PixelPlane& plane, float depth_jump) {
  const float inverse_depth = images.inverse_depth[static_cast<int64_t>(v) * frame.width + u];
  const float depth_m = 1.0f / inverse_depth;
  const Vec3f p_C = backProject(frame.intrinsics, static_cast<float>(u), static_cast<float>(v),
                                depth_m);
  // Where the plane moves to from one pixel to the next.
  Vec3f across = (-(plane.slope_u * depth_m)) * p_C, down = (-(plane.slope_v * depth_m)) * p_C;
  across.x += depth_m / frame.intrinsics.fx;
  down.y += depth_m / frame.intrinsics.fy;
  const float voxel_m2 = frame.voxel_size_m * frame.voxel_size_m;
  PixelParts parts{1, 1};
  if (dot(across, across) > voxel_m2 &&
      continuesToBothSides(frame, images, u, v, 1, 0, p_C, plane, depth_jump)) {
    parts.across = kThirds;
  }
  if (dot(down, down) > voxel_m2 &&
      continuesToBothSides(frame, images, u, v, 0, 1, p_C, plane, depth_jump)) {
    parts.down = kThirds;
  }
  return parts;
}

/// Centre of a part relative to the pixel's, in pixels: less than half a pixel to either side.
struct PartOffset {
  float u, v;
};

DTSDF_HD PartOffset partOffset(const PixelParts& parts, int part) {
  return {static_cast<float>(part % parts.across - parts.across / 2) /
              static_cast<float>(parts.across),
          static_cast<float>(part / parts.across - parts.down / 2) /
              static_cast<float>(parts.down)};
}

/// Inverse depth of a pixel's plane at an offset, but no farther away than the pixel and its
/// neighbours on the sides that the offset leads to, which have to be measured.
DTSDF_HD float inverseDepthBeside(const FitImages& images, int width, int u, int v,
                                  const PixelPlane& plane, const PartOffset& offset) {
  const float* at = images.inverse_depth + static_cast<int64_t>(v) * width + u;
  float least = *at;
  if (offset.u != 0.0f) least = minimum(least, at[offset.u < 0.0f ? -1 : 1]);
  if (offset.v != 0.0f) least = minimum(least, at[offset.v < 0.0f ? -width : width]);
  return maximum(*at + offset.u * plane.slope_u + offset.v * plane.slope_v, least);
}

}  // namespace dtsdf
