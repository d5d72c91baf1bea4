/// Between which depths the rays of a tile of the image may meet a surface: rays start there.
#pragma once

#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "kernels/core/voxel.h"

namespace dtsdf {

/// Side of a tile, in pixels.
constexpr int32_t kRangeTileSide = 4;

/// Depths along the optical axis, in voxels. Without a surface, near is beyond far.
struct TileRange {
  float near, far;
};

constexpr float kNoTileNear = 1e30f;

DTSDF_HD TileRange noTileRange() { return {kNoTileNear, 0.0f}; }

/// Tiles along a side of so many pixels.
DTSDF_HD int32_t rangeTilesFor(int32_t pixels) {
  return (pixels + kRangeTileSide - 1) / kRangeTileSide;
}

/// Voxels so near to a surface have it in one of the units around them, and every unit with a
/// surface has such a corner less than a voxel from wherever a ray meets it.
constexpr float kRangeDistance = 1.0f;

/// The tiles whose rays may come within a voxel of a point.
struct TileCover {
  int32_t u0, v0, u1, v1;  ///< Up to and with the last ones; none where u0 > u1.
  TileRange range;
};

/// The depths in which the rays of a tile meet the point's surface: with room for the unit before.
DTSDF_HD TileRange rangeAround(float depth) {
  constexpr float kRoom = 2.0f, kLeastDepth = 0.05f;
  return {maximum(depth - kRoom, kLeastDepth), depth + kRoom};
}

/// Tiles between two slopes of rays.
DTSDF_HD void coverSlopes(float low, float high, float focal, float middle, int32_t pixels,
                          int32_t& first, int32_t& last) {
  const float end = static_cast<float>(pixels);
  // Limits first: what is far outside would not fit an integer.
  const float a = minimum(maximum(focal * low + middle, 0.0f), end);
  const float b = minimum(maximum(focal * high + middle + 1.0f, -1.0f), end - 1.0f);
  first = floorToInt(a) / kRangeTileSide;
  last = b < 0.0f ? -1 : floorToInt(b) / kRangeTileSide;
}

/// Of a point in the local frame, in voxels.
DTSDF_HD TileCover coverTiles(const FrameView& frame, const Vec3f& p_L) {
  constexpr float kRadius = 1.0f, kLeastDepth = 0.1f;
  const Vec3f p = rotateInverse(frame.T_L_C, p_L - frame.T_L_C.t);
  TileCover cover{1, 1, 0, 0, rangeAround(p.z)};
  if (!(p.z + kRadius > kLeastDepth)) return cover;
  const float near = 1.0f / maximum(p.z - kRadius, kLeastDepth), far = 1.0f / (p.z + kRadius);
  const auto low = [&](float at) { return (at - kRadius) * (at < kRadius ? near : far); };
  const auto high = [&](float at) { return (at + kRadius) * (at > -kRadius ? near : far); };
  const Intrinsics& K = frame.intrinsics;
  coverSlopes(low(p.x), high(p.x), K.fx, K.cx, frame.width, cover.u0, cover.u1);
  coverSlopes(low(p.y), high(p.y), K.fy, K.cy, frame.height, cover.v0, cover.v1);
  return cover;
}

/// Whether a ray may pass through a block, or voxels of it be near to a surface that is in view;
/// false only if not.
DTSDF_HD bool mayReachView(const FrameView& frame, const BlockKey& block_L) {
  constexpr float kMiddle = 0.5f * (kBlockSide - 1);
  constexpr float kReach = 8.0f;  // to the far corner of the last unit, 7.8, and the voxels' reach
  return mayBeInView(frame, toFloat(firstVoxelOfBlock(block_L)) + Vec3f{kMiddle, kMiddle, kMiddle},
                     kReach);
}

/// Whether voxels of a block may be corners of units in blocks that mayReachView() accepts.
DTSDF_HD bool mayHaveCornersInView(const FrameView& frame, const BlockKey& block_L) {
  constexpr float kMiddle = 0.5f * (kBlockSide - 1);
  constexpr float kReach = 22.0f;  // the diagonal of a block, 13.9, beyond that of mayReachView()
  return mayBeInView(frame, toFloat(firstVoxelOfBlock(block_L)) + Vec3f{kMiddle, kMiddle, kMiddle},
                     kReach);
}

/// Whether a voxel holds a distance that counts.
DTSDF_HD bool isKnown(const Voxel& voxel, int32_t least_evidence) {
  return evidenceOf(voxel) >= least_evidence && !isEmpty(voxel);
}

/// Whether a known voxel is near enough to its surface that rays are to look for it there.
DTSDF_HD bool isNearSurface(const Voxel& voxel) {
  constexpr auto kUnits = static_cast<int32_t>(kRangeDistance * kStoredSdfScale);
  return voxel.sdf_units <= kUnits && voxel.sdf_units >= -kUnits;
}

DTSDF_HD bool isNearRay(const Voxel& voxel, int32_t least_evidence) {
  return isKnown(voxel, least_evidence) && isNearSurface(voxel);
}

}  // namespace dtsdf
