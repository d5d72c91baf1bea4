/// Which parts of a block a frame cannot see through, without a look at their voxels.
///
/// Most of what a frame might clear lies behind surfaces. Patches of the image keep their greatest
/// free depth: what is nowhere nearer than that of the patches that it covers is not seen through.
/// So most hidden blocks are skipped at once, and so are the hidden parts of others. What is
/// contradicted does not change by that.
#pragma once

#include "kernels/core/anchor.h"
#include "kernels/core/camera.h"
#include "kernels/core/grid.h"
#include "kernels/surfels/sensing.h"

namespace dtsdf {

/// Fine and coarse patches, by the side in pixels (other patches than those that are merged).
constexpr int kFinePatchLog2 = 3, kCoarsePatchLog2 = 5;

DTSDF_HD int32_t freePatchesAlong(int32_t pixels, int side_log2) {
  return (pixels + (1 << side_log2) - 1) >> side_log2;
}
DTSDF_HD int64_t freePatchCount(const FrameView& frame, int side_log2) {
  return static_cast<int64_t>(freePatchesAlong(frame.width, side_log2)) *
         freePatchesAlong(frame.height, side_log2);
}

/// Pixels, or patches, as far as there are any, row by row.
struct DepthGrid {
  const float* values;
  int32_t width, height;
};

/// The greatest value of a square of a grid.
DTSDF_HD float greatestIn(const DepthGrid& grid, int32_t first_u, int32_t first_v, int side) {
  float greatest = 0.0f;
  for (int32_t v = first_v; v < first_v + side && v < grid.height; ++v) {
    for (int32_t u = first_u; u < first_u + side && u < grid.width; ++u) {
      greatest = maximum(greatest, grid.values[static_cast<int64_t>(v) * grid.width + u]);
    }
  }
  return greatest;
}

/// What the corners of a box cover in the image. It has no `near_m` above 0 if one of them is
/// behind the camera.
DTSDF_HD SeenBounds boundsOfBox(const FrameView& frame, const Vec3f& low, const Vec3f& high) {
  SeenBounds bounds = boundsOf(projectToImage(frame, low));
  for (int i = 1; i < 8; ++i) {
    const Vec3f corner{i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
    bounds = unite(bounds, boundsOf(projectToImage(frame, corner)));
  }
  return bounds;
}

/// Whether a frame may see through some point of a box in the local frame, or through what lies
/// `beyond_m` behind it: false only if it does not.
DTSDF_HD bool maySeeThrough(const FrameSensing& sensing, const Vec3f& low, const Vec3f& high,
                            float beyond_m) {
  constexpr int kMostPatches = 16;  // along an edge; more are not looked at
  const FrameView& frame = sensing.image.frame;
  const SeenBounds seen = boundsOfBox(frame, low, high);
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
  if (extent >= kMostPatches << kCoarsePatchLog2) return true;
  const bool fine = extent < kMostPatches / 2 << kFinePatchLog2;
  const int log2 = fine ? kFinePatchLog2 : kCoarsePatchLog2;
  const float* patches = sensing.most_free + (fine ? 0 : freePatchCount(frame, kFinePatchLog2));
  const int32_t along = freePatchesAlong(frame.width, log2);
  for (int32_t v = top >> log2; v <= bottom >> log2; ++v) {
    for (int32_t u = left >> log2; u <= right >> log2; ++u) {
      if (seen.near_m + beyond_m < patches[static_cast<int64_t>(v) * along + u]) return true;
    }
  }
  return false;
}

/// By how much boxes are larger than what is in them, in voxels, so that rounding does not matter.
constexpr float kBoxMargin = 0.125f;

/// Whether a frame may see through any place of a block's voxels: they lie up to the truncation
/// from these, or an anchor's reach.
DTSDF_HD bool maySeeThroughBlock(const FrameSensing& sensing, const Vec3f& first_voxel_L,
                                 float truncation_voxels) {
  const float around = maximum(truncation_voxels, kAnchorReach) + kBoxMargin;
  const float beyond = static_cast<float>(kBlockSide - 1) + around;
  return maySeeThrough(sensing, first_voxel_L - Vec3f{around, around, around},
                       first_voxel_L + Vec3f{beyond, beyond, beyond}, 0.0f);
}

/// The eight halves of a block along its axes, a bit each.
using Octants = uint32_t;
constexpr int kOctants = 8;
constexpr Octants kAllOctants = (1u << kOctants) - 1u;

DTSDF_HD int octantOf(int index) {
  constexpr int kHalf = kBlockSideLog2 - 1;
  const Vec3i at = voxelOffset(index);
  return at.x >> kHalf | at.y >> kHalf << 1 | at.z >> kHalf << 2;
}

/// Whether a frame may see through an empty voxel of an octant, and the cells that this is a
/// corner of.
DTSDF_HD bool maySeeThroughOctant(const FrameSensing& sensing, const Vec3f& first_voxel_L,
                                  int octant) {
  constexpr int kSide = kBlockSide / 2;
  constexpr float kBeyond = static_cast<float>(kSide - 1) + kBoxMargin;
  const Vec3i offset{(octant & 1) * kSide, (octant >> 1 & 1) * kSide, (octant >> 2) * kSide};
  const Vec3f first = first_voxel_L + toFloat(offset);
  return maySeeThrough(sensing, first - Vec3f{kBoxMargin, kBoxMargin, kBoxMargin},
                       first + Vec3f{kBeyond, kBeyond, kBeyond}, sensing.image.frame.voxel_size_m);
}

/// All those of a block.
DTSDF_HD Octants octantsSeenThrough(const FrameSensing& sensing, const Vec3f& first_voxel_L) {
  Octants seen = 0;
  for (int i = 0; i < kOctants; ++i) {
    if (maySeeThroughOctant(sensing, first_voxel_L, i)) seen |= 1u << i;
  }
  return seen;
}

}  // namespace dtsdf
