/// Finds free cells from a depth image.
///
/// A cell is free if each pixel in the bounding rectangle of its eight corners is free beyond the
/// farthest corner; all corners must be in the image and within range. To test thousands of cells,
/// the smallest free depths are stored in a pyramid, in which a texel of level k stands for 2^k x
/// 2^k pixels. Texels of a coarser level include pixels outside the cell, so a free cell may be
/// missed, but a cell that is not free is never accepted.
#pragma once

#include "kernels/core/camera.h"
#include "kernels/space/cells.h"

namespace dtsdf {

/// Number of levels: enough for images of 2^14 pixels a side. In larger images, a cell may cover
/// many texels of the last level.
constexpr int kFreeLevels = 14;

/// Smallest free depths in metres; 0 where unknown. Level 0 holds the freeDepth() of each pixel.
struct FreePyramid {
  const float* level[kFreeLevels];
  int32_t width, height;  ///< Size of level 0.
};

/// Number of texels along a side of the image at this level.
DTSDF_HD int32_t texelsFor(int32_t pixels, int level) {
  return (pixels + (1 << level) - 1) >> level;
}

/// Minimum of the (up to) four texels that one texel of the next level combines.
DTSDF_HD float minBelow(const float* texels, int32_t width, int32_t height, int32_t u, int32_t v) {
  const int32_t left = 2 * u, right = left + 1 < width ? left + 1 : left;
  const int32_t top = 2 * v, bottom = top + 1 < height ? top + 1 : top;
  const float* upper = texels + static_cast<int64_t>(top) * width;
  const float* lower = texels + static_cast<int64_t>(bottom) * width;
  return minimum(minimum(upper[left], upper[right]), minimum(lower[left], lower[right]));
}

/// Whether the bounds are wholly inside the image and in front of the camera.
DTSDF_HD bool isFullyInImage(const FreePyramid& free, const ProjectedBounds& seen) {
  return seen.near_m > 0.0f && seen.left >= 0.0f && seen.top >= 0.0f &&
         seen.right < static_cast<float>(free.width) &&
         seen.bottom < static_cast<float>(free.height);
}

/// Whether all pixels within the bounds are free beyond the farthest depth of the bounds.
DTSDF_HD bool isSeenFree(const FreePyramid& free, const ProjectedBounds& seen) {
  constexpr int32_t kMaxSteps = 3;
  if (!isFullyInImage(free, seen)) return false;
  const auto left = static_cast<int32_t>(seen.left), right = static_cast<int32_t>(seen.right);
  const auto top = static_cast<int32_t>(seen.top), bottom = static_cast<int32_t>(seen.bottom);
  int k = 0;
  while (k + 1 < kFreeLevels &&
         ((right >> k) - (left >> k) > kMaxSteps || (bottom >> k) - (top >> k) > kMaxSteps)) {
    ++k;
  }
  const int64_t width = texelsFor(free.width, k);
  for (int32_t v = top >> k; v <= bottom >> k; ++v) {
    for (int32_t u = left >> k; u <= right >> k; ++u) {
      if (!(seen.far_m < free.level[k][v * width + u])) return false;
    }
  }
  return true;
}

/// The lowest corner of a cube of cells in the local frame, in voxels.
DTSDF_HD Vec3f cornerOfCube(const FrameView& frame, int32_t cell_log2, const Vec3i& cube) {
  const int32_t side = cubeSideInVoxels(cell_log2);
  return toFloat(Vec3i{cube.x * side, cube.y * side, cube.z * side} - frame.origin_voxel);
}

/// Number of cell corners along an edge of a cube.
constexpr int kCornersAlong = kCubeSide + 1;
constexpr int kCornersPerCube = kCornersAlong * kCornersAlong * kCornersAlong;

/// Projects corner `i` of a cube's cells, where x varies fastest. `first_L` is cornerOfCube().
DTSDF_HD VoxelInImage cornerInImage(const FrameView& frame, const Vec3f& first_L, int32_t cell_log2,
                                    int i) {
  const Vec3i steps{i % kCornersAlong, i / kCornersAlong % kCornersAlong,
                    i / (kCornersAlong * kCornersAlong)};
  return projectToImage(frame, first_L + static_cast<float>(cellSide(cell_log2)) * toFloat(steps));
}

/// Whether a whole cell is free in the image and nearer than max_range_m in depth. `corners` are
/// the projected corners of all cells in the cell's cube.
DTSDF_HD bool isCellSeenFree(const FreePyramid& free,
                             const VoxelInImage (&corners)[kCornersPerCube], int cell,
                             float max_range_m) {
  const Vec3i at = voxelOffset(cell);
  const VoxelInImage* first = corners + at.x + kCornersAlong * (at.y + kCornersAlong * at.z);
  ProjectedBounds bounds = boundsOf(*first);
  if (!isSeenFree(free, bounds)) return false;  // a single pixel rules out most cells
  for (int i = 1; i < 8; ++i) {
    const int step = (i & 1) + kCornersAlong * ((i >> 1 & 1) + kCornersAlong * (i >> 2));
    bounds = unite(bounds, boundsOf(first[step]));
  }
  return bounds.far_m <= max_range_m && isSeenFree(free, bounds);
}

}  // namespace dtsdf
