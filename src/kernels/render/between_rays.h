/// Pixels between those that a ray is cast for: where four rays meet one plane, all that is between
/// them is interpolated.
///
/// Rays are cast for every fourth pixel of each fourth row. Between those that meet one plane less
/// than a voxel apart nothing of the map is hidden; elsewhere, for every second one; and where
/// these do not meet a plane either, for each. So edges and folds are as sharp as with all rays.
#pragma once

#include "kernels/render/pixel.h"

namespace dtsdf {

/// Distances of rays: every fourth pixel, then every second one.
constexpr int32_t kFirstStride = 4, kSecondStride = 2;

/// Rays with such a distance: a pixel with both coordinates even multiples of it.
DTSDF_HD bool isOnLattice(const Pixel& pixel, int32_t stride) {
  return ((pixel.u | pixel.v) & (stride - 1)) == 0;
}

/// The square of four rays that a pixel lies in: its corner with the least coordinates.
DTSDF_HD Pixel squareOf(const Pixel& pixel, int32_t stride) {
  return {pixel.u & ~(stride - 1), pixel.v & ~(stride - 1)};
}

/// Whether all four rays of a square are in the image.
DTSDF_HD bool hasRays(const FrameView& frame, const Pixel& square, int32_t stride) {
  return square.u + stride < frame.width && square.v + stride < frame.height;
}

/// The rays of a square: row by row.
struct RaySquare {
  RenderedPixel corner[4];
};

/// `pixel_at(pixel)` gives what was rendered of a pixel of the lattice.
template <class PixelAt>
DTSDF_HD RaySquare raysOf(const Pixel& square, int32_t stride, const PixelAt& pixel_at) {
  return {{pixel_at(Pixel{square.u, square.v}), pixel_at(Pixel{square.u + stride, square.v}),
           pixel_at(Pixel{square.u, square.v + stride}),
           pixel_at(Pixel{square.u + stride, square.v + stride})}};
}

/// Whether the rays of a square meet one plane, that of the first of them, less than a voxel apart.
DTSDF_HD bool meetsPlane(const FrameView& frame, const Pixel& square, int32_t stride,
                         const RaySquare& rays) {
  constexpr float kFromPlane = 0.25f;  // in voxels
  const RenderedPixel& first = rays.corner[0];
  if (!(first.depth > 0.0f)) return false;
  if (!(static_cast<float>(stride) * first.depth < frame.intrinsics.fx)) return false;
  const auto way = [&](int k) {
    return backProject(frame.intrinsics, static_cast<float>(square.u + (k & 1) * stride),
                       static_cast<float>(square.v + (k >> 1) * stride), 1.0f);
  };
  const float offset = first.depth * dot(first.normal_C, way(0));  // of the plane; below 0
  for (int k = 1; k < 4; ++k) {
    const float depth = rays.corner[k].depth, cosine = dot(first.normal_C, way(k));
    if (!(depth > 0.0f && cosine < 0.0f)) return false;
    if (!(fabsf(depth * cosine - offset) <= -kFromPlane * cosine)) return false;
  }
  return true;
}

/// A pixel of a square whose rays meet a plane: inverse depths of a plane are linear in the pixel.
DTSDF_HD RenderedPixel pixelBetween(const RaySquare& rays, const Pixel& square, int32_t stride,
                                    const Pixel& pixel) {
  const float per_pixel = 1.0f / static_cast<float>(stride);
  const float right = per_pixel * static_cast<float>(pixel.u - square.u);
  const float down = per_pixel * static_cast<float>(pixel.v - square.v);
  const float share[4] = {(1.0f - right) * (1.0f - down), right * (1.0f - down),
                          (1.0f - right) * down, right * down};
  float inverse_depth = 0.0f;
  Vec3f normal{0.0f, 0.0f, 0.0f};
  ColourMean mean;
  for (int k = 0; k < 4; ++k) {
    const RenderedPixel& corner = rays.corner[k];
    inverse_depth += share[k] / corner.depth;
    normal = normal + share[k] * corner.normal_C;
    if (corner.colour.painted == 0) continue;
    mean.red += share[k] * static_cast<float>(corner.colour.red);
    mean.green += share[k] * static_cast<float>(corner.colour.green);
    mean.blue += share[k] * static_cast<float>(corner.colour.blue);
    mean.weight += share[k];
  }
  return {1.0f / inverse_depth, (1.0f / norm(normal)) * normal, colourOf(mean)};
}

}  // namespace dtsdf
