/// Anchors: where, near a corner of the grid, a surface was measured.
///
/// A voxel holds the distance to planes that were measured nearby, and so it tells of a surface
/// also where none was seen: past the end of what was measured its plane goes on. The anchor says
/// where it was: the measured point that lies nearest to the corner's foot on the plane, relative
/// to the corner. Vertices are held to it (meshing/anchoring.h).
#pragma once

#include "kernels/core/vec.h"

namespace dtsdf {

/// How far an anchor lies from its corner along each axis at most, in voxels.
constexpr float kAnchorReach = 1.0f;

/// An anchor is a number from 1 to 40^3, which tells its offset from the corner in 40 steps along
/// each axis.
constexpr uint16_t kNoAnchor = 0;
constexpr int32_t kAnchorSteps = 40;
constexpr float kStepsPerVoxel = kAnchorSteps / (2.0f * kAnchorReach);

/// `dither` in [0, 1) is 0.5 to round to the nearest step.
DTSDF_HD int32_t anchorStep(float offset, float dither) {
  const float step = (offset + kAnchorReach) * kStepsPerVoxel - 0.5f + dither;
  return floorToInt(minimum(maximum(step, 0.0f), kAnchorSteps - 1.0f));
}

DTSDF_HD uint16_t packAnchor(const Vec3f& offset, float dither) {
  const int32_t x = anchorStep(offset.x, dither), y = anchorStep(offset.y, dither),
                z = anchorStep(offset.z, dither);
  return static_cast<uint16_t>(1 + x + kAnchorSteps * (y + kAnchorSteps * z));
}

/// Offset from the corner, in voxels, of an anchor that there is.
DTSDF_HD Vec3f anchorOffset(uint16_t anchor) {
  const int32_t steps = anchor - 1;
  const auto offset = [](int32_t step) {
    return (static_cast<float>(step) + 0.5f) * (1.0f / kStepsPerVoxel) - kAnchorReach;
  };
  return {offset(steps % kAnchorSteps), offset(steps / kAnchorSteps % kAnchorSteps),
          offset(steps / (kAnchorSteps * kAnchorSteps))};
}

// A measured point beside a corner as one number, of which the greatest is the point nearest to the
// corner's foot: by atomics, too, whatever their order. 8 bits tell how near, in rings of equal
// area, and 8 bits each the offset along the axes; points that far apart that an offset does not
// fit have none (0).

constexpr float kPointSteps = 127.0f;
constexpr float kPointRings = 84.0f;  ///< Per squared voxel: 3 are the farthest.

/// How many bits the part for an axis is shifted by.
DTSDF_HD int pointShift(int axis) { return 16 - 8 * axis; }

/// Packs the offset along an axis. It has to fit: what is rounded is positive.
DTSDF_HD uint32_t packPoint(float offset) {
  return static_cast<uint32_t>(static_cast<int32_t>(offset * kPointSteps + 128.5f));
}

/// The part of the key that says how near: by the squared distance from the foot, in [0, 3].
DTSDF_HD uint32_t packNearness(float squared_distance) {
  const float rings = minimum(maximum(squared_distance, 0.0f) * kPointRings, 255.0f);
  return (255u - static_cast<uint32_t>(static_cast<int32_t>(rings))) << 24;
}

/// The key of a measured point at an offset from a corner whose distance from the point's plane is
/// given. The parts of the offset come in any order, each with its shift.
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
