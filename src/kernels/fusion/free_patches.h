/// Finds blocks in which a frame contradicts no voxel (see free_space.h), without reading their
/// voxels.
///
/// For each patch of the image, the largest freeDepth() is stored. A block is skipped if it is
/// outside the image, or behind this depth in all patches that it overlaps. This only saves time:
/// no voxel that the frame contradicts is skipped.
#pragma once

#include "kernels/core/anchor.h"
#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "kernels/surfels/sensing.h"

namespace dtsdf {

/// Side of a patch in pixels. The patches of pixel_merging.h are smaller.
constexpr int kFreePatchSideLog2 = 4, kFreePatchSide = 1 << kFreePatchSideLog2;

DTSDF_HD int32_t freePatchesAlong(int32_t pixels) {
  return (pixels + kFreePatchSide - 1) >> kFreePatchSideLog2;
}

/// Bounds of a box's corners in the image; near_m is not positive if a corner is behind the camera.
DTSDF_HD ProjectedBounds boundsOfBox(const FrameView& frame, const Vec3f& low, const Vec3f& high) {
  ProjectedBounds bounds = boundsOf(projectToImage(frame, low));
  for (int i = 1; i < 8; ++i) {
    const Vec3f corner{i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
    bounds = unite(bounds, boundsOf(projectToImage(frame, corner)));
  }
  return bounds;
}

/// Whether a frame may look through some point of a box in the local frame; false only if it looks
/// through no point.
DTSDF_HD bool maySeeThrough(const FrameSensing& sensing, const Vec3f& low, const Vec3f& high) {
  constexpr int kMaxPatches = 32;  // along a side; larger boxes are not ruled out
  const FrameView& frame = sensing.image.frame;
  const ProjectedBounds seen = boundsOfBox(frame, low, high);
  if (!(seen.near_m > 0.0f)) return true;
  const auto width = static_cast<float>(frame.width), height = static_cast<float>(frame.height);
  if (!(seen.left < width && seen.right >= 0.0f && seen.top < height && seen.bottom >= 0.0f)) {
    return false;
  }
  const auto left = static_cast<int32_t>(maximum(seen.left, 0.0f)),
             right = static_cast<int32_t>(minimum(seen.right, width - 1.0f)),
             top = static_cast<int32_t>(maximum(seen.top, 0.0f)),
             bottom = static_cast<int32_t>(minimum(seen.bottom, height - 1.0f));
  const int32_t extent = right - left > bottom - top ? right - left : bottom - top;
  if (extent >= kMaxPatches << kFreePatchSideLog2) return true;
  const int32_t along = freePatchesAlong(frame.width);
  for (int32_t v = top >> kFreePatchSideLog2; v <= bottom >> kFreePatchSideLog2; ++v) {
    for (int32_t u = left >> kFreePatchSideLog2; u <= right >> kFreePatchSideLog2; ++u) {
      if (seen.near_m < sensing.max_free[static_cast<int64_t>(v) * along + u]) return true;
    }
  }
  return false;
}

/// Whether a frame may look through the place of any voxel in a block. Along each axis, a place is
/// at most the truncation distance or kAnchorReach, whichever is larger, away from its voxel.
DTSDF_HD bool maySeeThroughBlock(const FrameSensing& sensing, const Vec3f& first_voxel_L,
                                 float truncation_voxels) {
  constexpr float kMargin = 0.125f;  // so that rounding does not matter
  const float around = maximum(truncation_voxels, kAnchorReach) + kMargin;
  const float beyond = static_cast<float>(kBlockSide - 1) + around;
  return maySeeThrough(sensing, first_voxel_L - Vec3f{around, around, around},
                       first_voxel_L + Vec3f{beyond, beyond, beyond});
}

}  // namespace dtsdf
