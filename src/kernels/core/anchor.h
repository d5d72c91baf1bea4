/// An anchor is a point near a grid corner at which that corner's surface was measured.
///
/// A corner's foot is its nearest point on the surface. In one frame, the anchor is the measured
/// point that is nearest to the foot, along the surface; over frames, it is the weighted mean of
/// these points. The distance alone would extend a surface past the end of what was measured, so
/// vertices are pulled towards anchors (meshing/anchoring.h).
#pragma once

#include "kernels/core/vec.h"

namespace dtsdf {

/// Largest offset of an anchor from its corner along each axis, in voxels.
constexpr float kAnchorReach = 1.0f;

/// An anchor is stored as a number from 1 to 40^3: its offset from the corner, in 40 steps along
/// each axis.
constexpr uint16_t kNoAnchor = 0;
constexpr int32_t kAnchorSteps = 40;
constexpr float kStepsPerVoxel = kAnchorSteps / (2.0f * kAnchorReach);

/// `dither` is in [0, 1); 0.5 rounds to the nearest step.
DTSDF_HD int32_t anchorStep(float offset, float dither) {
  const float step = (offset + kAnchorReach) * kStepsPerVoxel - 0.5f + dither;
  return floorToInt(minimum(maximum(step, 0.0f), kAnchorSteps - 1.0f));
}

DTSDF_HD uint16_t packAnchor(const Vec3f& offset, float dither) {
  const int32_t x = anchorStep(offset.x, dither), y = anchorStep(offset.y, dither),
                z = anchorStep(offset.z, dither);
  return static_cast<uint16_t>(1 + x + kAnchorSteps * (y + kAnchorSteps * z));
}

/// Offset from the corner, in voxels. @pre The anchor is not kNoAnchor.
DTSDF_HD Vec3f anchorOffset(uint16_t anchor) {
  const int32_t steps = anchor - 1;
  const auto offset = [](int32_t step) {
    return (static_cast<float>(step) + 0.5f) * (1.0f / kStepsPerVoxel) - kAnchorReach;
  };
  return {offset(steps % kAnchorSteps), offset(steps / kAnchorSteps % kAnchorSteps),
          offset(steps / (kAnchorSteps * kAnchorSteps))};
}

// A measured point near a corner is packed into a key: 8 bits for the nearness to the corner's
// foot, in equal steps of squared distance, followed by 8 bits for the offset along each axis. The
// nearest point has the largest key, so an atomic maximum finds it regardless of the order of
// points. A point farther away than kAnchorReach along any axis has the key 0.

constexpr float kPointSteps = 127.0f;
constexpr float kNearnessSteps = 84.0f;  ///< Per squared voxel; squared distances are at most 3.

/// Bit position of an axis's offset in the key.
DTSDF_HD int pointShift(int axis) { return 16 - 8 * axis; }

/// Packs an offset in [-kAnchorReach, kAnchorReach] along one axis into 8 bits.
DTSDF_HD uint32_t packPoint(float offset) {
  return static_cast<uint32_t>(static_cast<int32_t>(offset * kPointSteps + 128.5f));
}

/// Nearness bits of a key, from the point's squared distance to the foot.
DTSDF_HD uint32_t packNearness(float squared_distance) {
  const float rings = minimum(maximum(squared_distance, 0.0f) * kNearnessSteps, 255.0f);
  return (255u - static_cast<uint32_t>(static_cast<int32_t>(rings))) << 24;
}

/// Key of the point at `offset` from a corner; `plane_distance` is the corner's distance from the
/// point's plane. `shifts` holds the pointShift() of each component of `offset`.
DTSDF_HD uint32_t pointKey(const Vec3f& offset, const Vec3i& shifts, float plane_distance) {
  const float farthest = maximum(maximum(fabsf(offset.x), fabsf(offset.y)), fabsf(offset.z));
  const uint32_t key = packNearness(dot(offset, offset) - plane_distance * plane_distance) |
                       packPoint(offset.x) << shifts.x | packPoint(offset.y) << shifts.y |
                       packPoint(offset.z) << shifts.z;
  return farthest <= kAnchorReach ? key : 0u;
}

DTSDF_HD float unpackPoint(uint32_t key, int axis) {
  const uint32_t steps = key >> pointShift(axis) & 255u;
  return (static_cast<float>(static_cast<int32_t>(steps)) - 128.0f) * (1.0f / kPointSteps);
}

/// The point's offset from the corner, in voxels.
DTSDF_HD Vec3f pointOffset(uint32_t key) {
  return {unpackPoint(key, 0), unpackPoint(key, 1), unpackPoint(key, 2)};
}

}  // namespace dtsdf
