/// Which voxels an image saw as free, and what that does to them.
///
/// Casting along normals writes near surfaces only, so nothing it has written is ever taken back:
/// beside silhouettes the surface overhangs by a voxel or two, and stray measurements stay. Voxel
/// projection clears such places by itself; the paper's other modes do not.
///
/// A voxel is seen as free if it lies in front of the surface, by more than any sample may, in all
/// of the 3 x 3 pixels around its own. It then loses weight, if it is behind a surface: that is where
/// overhang and strays have their inside. Distances are left alone, and so are voxels in front. A
/// weight may fall below 0, to a debt that later strays have to pay off before they show.
#pragma once

#include "kernels/fusion/ray_casting.h"

namespace dtsdf {

/// What a frame says for free space, as a share of the weight of the pixels that cover the voxel. A
/// surface there would give it some three times as much.
constexpr float kFreeShare = 0.1f;
/// The debt is so many times what one frame adds to it at most: a thing that is put where space was
/// free appears after some frames, if it is seen from about as near.
constexpr float kLargestDebt = 10.0f;
/// Depth in metres below which a voxel is not covered by more and more pixels: near the camera their
/// number has no bound.
constexpr float kNearestFree = 0.5f;
/// Beyond the reach of samples, in standard deviations of the noise.
constexpr float kFreeNoise = 3.0f;

struct FreeSpaceSettings {
  float depth_jump;
  float truncation_voxels;
  float noise;  ///< Standard deviation of the frame's inverse depth, in 1/m.
};

/// Slope of inverse depth down a column, between the row fits on the sides that are connected.
/// @return whether any is.
DTSDF_HD bool slopeDown(const FitImages& images, int width, int height, int64_t centre, int v,
                        float depth_jump, float& slope) {
  const float* value = images.row_value + centre;
  const float above = v > 0 ? value[-width] : 0.0f;
  const float below = v < height - 1 ? value[width] : 0.0f;
  const bool to_above = above > 0.0f && depthsConnected(above, *value, depth_jump);
  const bool to_below = below > 0.0f && depthsConnected(below, *value, depth_jump);
  const float upper = *value - above, lower = below - *value;
  slope = to_above ? (to_below ? 0.5f * (upper + lower) : upper) : lower;
  return to_above || to_below;
}

/// Depth in metres up to which the ray of a pixel is free: from there on a point is nearer to the
/// plane of what was measured than samples reach. 0 or less where nothing is known.
DTSDF_HD float freeDepth(const FrameView& frame, const FitImages& images, int u, int v,
                         const FreeSpaceSettings& settings) {
  const int64_t centre = static_cast<int64_t>(v) * frame.width + u;
  const float inverse_depth = images.inverse_depth[centre];
  float slope_v;
  if (!(inverse_depth > 0.0f) || !(images.row_value[centre] > 0.0f) ||
      !slopeDown(images, frame.width, frame.height, centre, v, settings.depth_jump, slope_v)) {
    return 0.0f;
  }
  // With the plane 1 / z = n^T (x, y, 1), a point at depth z on the pixel's ray is
  // (1 - z / depth) / |n| off.
  const Intrinsics& K = frame.intrinsics;
  const float slope_u = images.row_slope[centre];
  const Vec3f n{K.fx * slope_u, K.fy * slope_v,
                inverse_depth - (static_cast<float>(u) - K.cx) * slope_u -
                    (static_cast<float>(v) - K.cy) * slope_v};
  const float depth_m = 1.0f / inverse_depth;
  const float noise_voxels = settings.noise * depth_m * depth_m / frame.voxel_size_m;
  const float margin_voxels =
      sampleReach(settings.truncation_voxels, noise_voxels) + kFreeNoise * noise_voxels;
  return depth_m - margin_voxels * frame.voxel_size_m * norm(n) * depth_m;
}

/// Weight that speaks for a voxel to be free; 0 if it was not seen so. `free_depth` is an image.
DTSDF_HD float freeEvidence(const FrameView& frame, const float* free_depth,
                            const VoxelInImage& at) {
  if (!(at.depth_m > 0.0f && at.u >= 1.0f && at.v >= 1.0f &&
        at.u < static_cast<float>(frame.width - 1) &&
        at.v < static_cast<float>(frame.height - 1))) {
    return 0.0f;
  }
  const float* centre =
      free_depth + static_cast<int64_t>(at.v) * frame.width + static_cast<int64_t>(at.u);
  if (!(at.depth_m < *centre)) return 0.0f;
  for (int dv = -1; dv <= 1; ++dv) {
    const float* row = centre + static_cast<int64_t>(dv) * frame.width;
    if (!(at.depth_m < row[-1] && at.depth_m < row[0] && at.depth_m < row[1])) return 0.0f;
  }
  const float voxel_px =
      frame.intrinsics.fx * frame.voxel_size_m / maximum(at.depth_m, kNearestFree);
  return kFreeShare * depthWeight(at.depth_m) * (voxel_px * voxel_px);
}

/// A voxel after it was seen as free.
DTSDF_HD Voxel clearedVoxel(const Voxel& voxel, float evidence) {
  if (voxel.weight > 0.0f && voxel.sdf >= 0.0f) return voxel;
  const float least = minimum(-(kLargestDebt * evidence), voxel.weight);
  const float weight = maximum(voxel.weight - evidence, least);
  return weight > 0.0f ? Voxel{voxel.sdf, weight} : Voxel{0.0f, minimum(weight, -kLeastDebt)};
}

}  // namespace dtsdf
