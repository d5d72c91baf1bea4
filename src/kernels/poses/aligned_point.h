/// The points of a depth image that it is aligned to the map by.
#pragma once

#include "kernels/core/camera.h"
#include "kernels/poses/alignment_rules.h"

namespace dtsdf {

/// A measured point and its unit normal in the camera's optical frame, in voxels. Weight 0: none.
struct AlignedPoint {
  Vec3f p_C;
  Vec3f normal_C;
  float weight;
};

DTSDF_HD AlignedPoint noAlignedPoint() { return {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, 0.0f}; }

/// Where the points of an image lie: every `stride`-th pixel of each row and column.
struct AlignmentGrid {
  int32_t stride, columns, rows;
};

/// So many points as the rules ask for, or a few more.
DTSDF_HD AlignmentGrid alignmentGrid(const FrameView& frame, const AlignmentRules& rules) {
  int32_t stride = 1;
  while (static_cast<int64_t>(frame.width / (stride + 1)) * (frame.height / (stride + 1)) >=
         rules.points) {
    ++stride;
  }
  return {stride, frame.width / stride, frame.height / stride};
}

DTSDF_HD Pixel pixelOfPoint(const AlignmentGrid& grid, int32_t index) {
  return {(index % grid.columns) * grid.stride + grid.stride / 2,
          (index / grid.columns) * grid.stride + grid.stride / 2};
}

/// Sums of a plane fit of inverse depths over pairs of pixels on opposite sides of the middle one,
/// which part its value from its slopes.
struct PairSums {
  float value, uu, uv, vv, u, v;
  int32_t pairs;
};

/// The plane in inverse depth around a pixel: value and slopes per pixel.
struct AlignedPlane {
  float value, slope_u, slope_v;
  bool known;
};

/// Fits a plane to the window around a pixel, of those pairs of opposite pixels that lie on one
/// surface with it: the mean of their inverse depths hardly differs from its own.
/// `inverse_depth(du, dv)` is above 0 where something is measured.
template <class InverseDepth>
DTSDF_HD AlignedPlane fitAlignedPlane(const AlignmentSettings& settings,
                                      const InverseDepth& inverse_depth) {
  const float middle = inverse_depth(0, 0);
  if (!(middle > 0.0f)) return {0.0f, 0.0f, 0.0f, false};
  PairSums sums{middle, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0};
  const int32_t r = settings.rules.window_px;
  for (int32_t dv = 0; dv <= r; ++dv) {
    for (int32_t du = dv == 0 ? 1 : -r; du <= r; ++du) {
      const float ahead = inverse_depth(du, dv), behind = inverse_depth(-du, -dv);
      if (!(ahead > 0.0f) || !(behind > 0.0f)) continue;
      const float mean = 0.5f * (ahead + behind), half = 0.5f * (ahead - behind);
      if (fabsf(mean - middle) > settings.depth_jump * middle) continue;
      const auto u = static_cast<float>(du), v = static_cast<float>(dv);
      sums.value += mean;
      sums.uu += u * u;
      sums.uv += u * v;
      sums.vv += v * v;
      sums.u += u * half;
      sums.v += v * half;
      ++sums.pairs;
    }
  }
  const int32_t all = 2 * r * (r + 1);
  const float determinant = sums.uu * sums.vv - sums.uv * sums.uv;
  if (2 * sums.pairs < all || !(determinant > 0.0f)) return {0.0f, 0.0f, 0.0f, false};
  return {sums.value / static_cast<float>(sums.pairs + 1),
          (sums.u * sums.vv - sums.v * sums.uv) / determinant,
          (sums.v * sums.uu - sums.u * sums.uv) / determinant, true};
}

/// The point of a pixel. A point counts by how squarely it is seen, and less the farther it is:
/// noise grows with distance.
template <class InverseDepth>
DTSDF_HD AlignedPoint makeAlignedPoint(const FrameView& frame, const Pixel& pixel,
                                       const AlignmentSettings& settings,
                                       const InverseDepth& inverse_depth) {
  const int32_t r = settings.rules.window_px;
  if (pixel.u < r || pixel.v < r || pixel.u + r >= frame.width || pixel.v + r >= frame.height) {
    return noAlignedPoint();
  }
  const AlignedPlane plane = fitAlignedPlane(settings, inverse_depth);
  if (!plane.known) return noAlignedPoint();
  const Intrinsics& K = frame.intrinsics;
  const float u = static_cast<float>(pixel.u), v = static_cast<float>(pixel.v);
  const float depth_m = 1.0f / plane.value;
  const Vec3f p_C = backProject(K, u, v, depth_m);
  const Vec3f away{K.fx * plane.slope_u, K.fy * plane.slope_v,
                   plane.value - (u - K.cx) * plane.slope_u - (v - K.cy) * plane.slope_v};
  const Vec3f normal_C = (-1.0f / norm(away)) * away;
  const float cosine = -dot(p_C, normal_C) / norm(p_C);
  if (!(cosine > 0.0f)) return noAlignedPoint();
  const float near = minimum(plane.value * settings.full_weight_depth_m, 1.0f);
  return {(1.0f / frame.voxel_size_m) * p_C, normal_C, cosine * near * near};
}

}  // namespace dtsdf
