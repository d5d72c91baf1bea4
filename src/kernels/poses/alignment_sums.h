/// Distances from an image's points to the map's surfaces, and the sums for Gauss-Newton steps on
/// the image's pose.
///
/// A point is compared with the signed distances in the directions to which its normal belongs. So
/// in a directional map, points on the front of a thin plate are not attracted by its back.
#pragma once

#include "kernels/core/camera.h"
#include "kernels/core/direction.h"
#include "kernels/core/voxel.h"
#include "kernels/poses/alignment_rules.h"

namespace dtsdf {

/// A measured point and its unit normal in the camera's optical frame, in voxels. The weight is 0
/// if there is no point.
struct AlignedPoint {
  Vec3f p_C;
  Vec3f normal_C;
  float weight;
};

DTSDF_HD AlignedPoint noAlignedPoint() { return {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, 0.0f}; }

/// The grid of an image's points: every `stride`-th column and row.
struct AlignmentGrid {
  int32_t stride, columns, rows;
};

/// The coarsest grid with at least rules.points points, or all pixels if the image has fewer.
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

/// Fits a plane in inverse depth, with slopes per pixel, to the window around a pixel. It uses
/// pairs of opposite pixels whose mean hardly differs from the value at the centre, so that they
/// lie on the same surface. `inverse_depth(du, dv)` is positive where something is measured.
/// @return false if the centre is not measured, fewer than half of the pairs are used, or the used
/// pixels are collinear.
template <class InverseDepth>
DTSDF_HD bool fitAlignedPlane(const AlignmentSettings& settings, const InverseDepth& inverse_depth,
                              float& value, float& slope_u, float& slope_v) {
  const float middle = inverse_depth(0, 0);
  if (!(middle > 0.0f)) return false;
  // Sums over pairs of opposite pixels separate the value from the slopes.
  float sum = middle, sum_uu = 0.0f, sum_uv = 0.0f, sum_vv = 0.0f, sum_u = 0.0f, sum_v = 0.0f;
  int32_t pairs = 0;
  const int32_t r = settings.rules.window_px;
  for (int32_t dv = 0; dv <= r; ++dv) {
    for (int32_t du = dv == 0 ? 1 : -r; du <= r; ++du) {
      const float ahead = inverse_depth(du, dv), behind = inverse_depth(-du, -dv);
      if (!(ahead > 0.0f) || !(behind > 0.0f)) continue;
      const float mean = 0.5f * (ahead + behind), half = 0.5f * (ahead - behind);
      if (fabsf(mean - middle) > settings.depth_jump * middle) continue;
      const auto u = static_cast<float>(du), v = static_cast<float>(dv);
      sum += mean;
      sum_uu += u * u;
      sum_uv += u * v;
      sum_vv += v * v;
      sum_u += u * half;
      sum_v += v * half;
      ++pairs;
    }
  }
  const int32_t all = 2 * r * (r + 1);
  const float determinant = sum_uu * sum_vv - sum_uv * sum_uv;
  if (2 * pairs < all || !(determinant > 0.0f)) return false;
  value = sum / static_cast<float>(pairs + 1);
  slope_u = (sum_u * sum_vv - sum_v * sum_uv) / determinant;
  slope_v = (sum_v * sum_uu - sum_u * sum_uv) / determinant;
  return true;
}

/// The point of a pixel. Its weight is the cosine between normal and ray, times a factor that falls
/// with depth, since noise grows with depth. Pixels near the image's border or without a plane
/// yield no point.
template <class InverseDepth>
DTSDF_HD AlignedPoint makeAlignedPoint(const FrameView& frame, const Pixel& pixel,
                                       const AlignmentSettings& settings,
                                       const InverseDepth& inverse_depth) {
  const int32_t r = settings.rules.window_px;
  if (pixel.u < r || pixel.v < r || pixel.u + r >= frame.width || pixel.v + r >= frame.height) {
    return noAlignedPoint();
  }
  float value, slope_u, slope_v;
  if (!fitAlignedPlane(settings, inverse_depth, value, slope_u, slope_v)) return noAlignedPoint();
  const Intrinsics& K = frame.intrinsics;
  const float u = static_cast<float>(pixel.u), v = static_cast<float>(pixel.v);
  const float depth_m = 1.0f / value;
  const Vec3f p_C = backProject(K, u, v, depth_m);
  const Vec3f away{K.fx * slope_u, K.fy * slope_v,
                   value - (u - K.cx) * slope_u - (v - K.cy) * slope_v};
  const Vec3f normal_C = (-1.0f / norm(away)) * away;
  const float cosine = -dot(p_C, normal_C) / norm(p_C);
  if (!(cosine > 0.0f)) return noAlignedPoint();
  const float near = minimum(value * settings.full_weight_depth_m, 1.0f);
  return {(1.0f / frame.voxel_size_m) * p_C, normal_C, cosine * near * near};
}

/// Signed distance at a point, in voxels, and its gradient.
struct FieldSample {
  float sdf;
  Vec3f gradient;
  bool known;
};

/// Interpolates trilinearly between the eight voxels around a point, which must all be known.
/// `voxel(at)` returns a voxel of the local frame's grid.
template <class VoxelAt>
DTSDF_HD FieldSample sampleField(const Vec3f& p_L, VoxelAt&& voxel) {
  const Vec3i base{floorToInt(p_L.x), floorToInt(p_L.y), floorToInt(p_L.z)};
  const Vec3f f = p_L - toFloat(base);
  // Two opposite corners are read first, as one of them is often empty.
  float sdf[8];
  bool known = true;
  const auto read = [&](int i) {
    const Voxel corner = voxel(Vec3i{base.x + (i & 1), base.y + (i >> 1 & 1), base.z + (i >> 2)});
    known = known & !isEmpty(corner) & (evidenceOf(corner) > 0);
    sdf[i] = sdfOf(corner);
  };
  read(0);
  read(7);
  if (!known) return {0.0f, {0.0f, 0.0f, 0.0f}, false};
  for (int i = 1; i < 7; ++i) read(i);
  if (!known) return {0.0f, {0.0f, 0.0f, 0.0f}, false};
  // Along x, then y, then z. The slope along an axis is computed before interpolating along that
  // axis.
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  const float x00 = mix(sdf[0], sdf[1], f.x), x10 = mix(sdf[2], sdf[3], f.x);
  const float x01 = mix(sdf[4], sdf[5], f.x), x11 = mix(sdf[6], sdf[7], f.x);
  const float dx = mix(mix(sdf[1] - sdf[0], sdf[3] - sdf[2], f.y),
                       mix(sdf[5] - sdf[4], sdf[7] - sdf[6], f.y), f.z);
  const float dy = mix(x10 - x00, x11 - x01, f.z);
  const float y0 = mix(x00, x10, f.y), y1 = mix(x01, x11, f.y);
  return {mix(y0, y1, f.z), {dx, dy, y1 - y0}, true};
}

/// The weighted mean of sampleField(), where known, over the directions to which a normal belongs.
/// `voxel(direction, at)` returns a voxel of a direction's grid.
template <class VoxelAt>
DTSDF_HD FieldSample sampleDirections(const Vec3f& p_L, const DirectionSet& directions,
                                      VoxelAt&& voxel) {
  float weight = 0.0f, sdf = 0.0f;
  Vec3f gradient{0.0f, 0.0f, 0.0f};
  for (int i = 0; i < directions.count; ++i) {
    const FieldSample sample =
        sampleField(p_L, [&](const Vec3i& at) { return voxel(directions.direction[i], at); });
    if (!sample.known) continue;
    weight += directions.weight[i];
    sdf += directions.weight[i] * sample.sdf;
    gradient = gradient + directions.weight[i] * sample.gradient;
  }
  if (!(weight > 0.0f)) return {0.0f, {0.0f, 0.0f, 0.0f}, false};
  return {sdf / weight, (1.0f / weight) * gradient, true};
}

/// Offset along a point's normal at which its surface is searched for in the n-th step, in voxels:
/// 0, 1, -1, 2, -2 and so on.
DTSDF_HD float searchOffset(int32_t n) {
  const int32_t k = (n + 1) / 2;
  return static_cast<float>(n % 2 == 1 ? k : -k);
}

/// Number of search steps whose searchOffset() is at most `reach` voxels.
DTSDF_HD int32_t searchOffsetCount(float reach) { return 2 * static_cast<int32_t>(reach) + 1; }

/// Minimum cosine between the map's gradient and a point's normal: cos(pi/4).
constexpr float kMinAgreement = 0.70710678f;

/// The distance from a point to the map's plane at an offset of `away` voxels along the point's
/// normal; unknown if the plane's orientation does not match the normal.
template <class VoxelAt>
DTSDF_HD FieldSample findPlane(const Vec3f& p_L, const Vec3f& normal,
                               const DirectionSet& directions, float away, VoxelAt&& voxel) {
  FieldSample field = sampleDirections(p_L + away * normal, directions, voxel);
  if (!field.known) return field;
  const float length = norm(field.gradient), slope = dot(field.gradient, normal);
  field.known = slope > kMinAgreement * length;
  // The gradient of a distance has the length 1, even where averaging has flattened it.
  field.gradient = (1.0f / length) * field.gradient;
  field.sdf -= away * (slope / length);
  return field;
}

/// The distance from a point to the surface, in voxels. If findPlane() finds no plane at the point
/// itself, the nearest plane along the point's normal is used, up to `reach` voxels away.
template <class VoxelAt>
DTSDF_HD FieldSample findSurface(const Vec3f& p_L, const Vec3f& normal, bool directional,
                                 float reach, VoxelAt&& voxel) {
  const DirectionSet directions = directionsOf(normal, directional);
  for (int32_t n = 0; n < searchOffsetCount(reach); ++n) {
    const FieldSample field = findPlane(p_L, normal, directions, searchOffset(n), voxel);
    if (field.known) return field;
  }
  return {0.0f, {0.0f, 0.0f, 0.0f}, false};
}

/// Terms of the normal equations' upper triangle, in row-major order: rotation about the camera,
/// then translation, both along the axes of the map.
constexpr int kPoseTerms = 21;

/// Sums over points, in fixed point so that they do not depend on the order of points.
struct AlignmentSums {
  int64_t normal[kPoseTerms];  ///< Sum of weight * J^T J.
  int64_t right[6];            ///< Sum of weight * J^T residual.
  int64_t squares;             ///< Sum of weight * residual^2.
  int64_t weight;
  int64_t points;            ///< Points of the image.
  int64_t matched, inliers;  ///< Points with a surface, and those that fit it.
};

/// Units of the sums. Points are less than 2^12 voxels from the camera and their weights at most 1.
/// So a term is below 2^24, a sum over 2^23 points below 2^47, and in units of 2^-14 below 2^61.
constexpr float kAlignmentScale = 16384.0f;  // 2^14
constexpr float kLongestLever = 4096.0f;     // 2^12

DTSDF_HD int64_t toAlignmentUnits(float value) {
  return static_cast<int64_t>(value * kAlignmentScale);
}

/// Adds a point at the frame's pose. A point with a residual of `cutoff` voxels or more is not an
/// inlier, and adds nothing to the equations. `find(p_L, normal)` calls findSurface().
template <class Find>
DTSDF_HD void addPoint(AlignmentSums& sums, const FrameView& frame, const AlignedPoint& point,
                       float cutoff, Find&& find) {
  if (!(point.weight > 0.0f)) return;
  sums.points += 1;
  const Vec3f lever = rotate(frame.T_L_C, point.p_C), normal = rotate(frame.T_L_C, point.normal_C);
  if (!(norm(lever) < kLongestLever)) return;
  const FieldSample field = find(lever + frame.T_L_C.t, normal);
  if (!field.known) return;
  sums.matched += 1;
  const Vec3f& g = field.gradient;
  const float residual = field.sdf;
  const float share = residual / cutoff, rest = 1.0f - share * share;
  if (!(rest > 0.0f)) return;
  sums.inliers += 1;
  const float weight = point.weight * rest * rest;  // Tukey's biweight
  const Vec3f turn = cross(lever, g);
  const float J[6] = {turn.x, turn.y, turn.z, g.x, g.y, g.z};
  int term = 0;
  for (int i = 0; i < 6; ++i) {
    const float scaled = weight * J[i];
    for (int k = i; k < 6; ++k) sums.normal[term++] += toAlignmentUnits(scaled * J[k]);
    sums.right[i] += toAlignmentUnits(scaled * residual);
  }
  sums.squares += toAlignmentUnits(weight * residual * residual);
  sums.weight += toAlignmentUnits(weight);
}

}  // namespace dtsdf
