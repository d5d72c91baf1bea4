/// Which voxels an image saw as free, and what that does to them.
///
/// Casting along normals writes near surfaces only, so nothing it has written is ever taken back:
/// beside silhouettes the surface overhangs by a voxel or two, and stray measurements stay. Voxel
/// projection clears such places by itself; the paper's other modes do not.
///
/// A voxel is seen as free if it lies in front of the surface, by more than any sample may, in all
/// of the 3 x 3 pixels around its own. It then loses weight, if it is behind a surface: that is
/// where overhang and strays have their inside. Distances are left alone, and so are voxels in
/// front. A weight may fall below 0: later strays have to make up for that before they show.
#pragma once

#include "kernels/fusion/sample_line.h"
#include "kernels/fusion/voxel_update.h"

namespace dtsdf {

/// A slope that may not be known.
struct MaybeSlope {
  float slope;
  bool known;
};

/// Slope of inverse depth down a column, between the row fits on the sides that are connected.
DTSDF_HD MaybeSlope slopeDown(const ImageView& image, const Pixel& pixel,
                              const SurfelSettings& surfels) {
  const int width = image.frame.width;
  const float* value = image.row_value + pixelIndex(image.frame, pixel);
  const float above = pixel.v > 0 ? value[-width] : 0.0f;
  const float below = pixel.v < image.frame.height - 1 ? value[width] : 0.0f;
  const bool to_above = above > 0.0f && depthsConnected(above, *value, surfels);
  const bool to_below = below > 0.0f && depthsConnected(below, *value, surfels);
  const float upper = *value - above, lower = below - *value;
  return {to_above ? (to_below ? 0.5f * (upper + lower) : upper) : lower, to_above || to_below};
}

/// Depth in metres up to which the ray of a pixel is free: from there on a point is nearer to the
/// plane of what was measured than samples reach. 0 or less where nothing is known.
DTSDF_HD float freeDepth(const FrameSensing& sensing, const Pixel& pixel,
                         const SurfelSettings& surfels, const FusionSettings& fusion) {
  const FrameView& frame = sensing.image.frame;
  const int64_t at = pixelIndex(frame, pixel);
  const float inverse_depth = sensing.image.inverse_depth[at];
  if (!(inverse_depth > 0.0f) || !(sensing.image.row_value[at] > 0.0f)) return 0.0f;
  const MaybeSlope down = slopeDown(sensing.image, pixel, surfels);
  if (!down.known) return 0.0f;
  // With the plane 1 / z = n^T (x, y, 1), a point at depth z on the pixel's ray is
  // (1 - z / depth) / |n| off.
  const Intrinsics& K = frame.intrinsics;
  const float slope_u = sensing.image.row_slope[at], slope_v = down.slope;
  const Vec3f n{K.fx * slope_u, K.fy * slope_v,
                inverse_depth - (static_cast<float>(pixel.u) - K.cx) * slope_u -
                    (static_cast<float>(pixel.v) - K.cy) * slope_v};
  const float depth_m = 1.0f / inverse_depth;
  const float noise_voxels = noiseInVoxels(sensing, depth_m);
  const float margin_voxels =
      sampleReach(noise_voxels, fusion) + fusion.rules.free_noise * noise_voxels;
  return depth_m - margin_voxels * frame.voxel_size_m * norm(n) * depth_m;
}

/// Weight that a frame gives to a voxel for being free; 0 if it was not seen so.
DTSDF_HD float freeSpaceWeight(const FrameSensing& sensing, const VoxelInImage& at,
                               const SurfelRules& surfel_rules, const FusionRules& rules) {
  const FrameView& frame = sensing.image.frame;
  if (!(at.depth_m > 0.0f && at.u >= 1.0f && at.v >= 1.0f &&
        at.u < static_cast<float>(frame.width - 1) &&
        at.v < static_cast<float>(frame.height - 1))) {
    return 0.0f;
  }
  const float* centre = sensing.free_depth + static_cast<int64_t>(at.v) * frame.width +
                        static_cast<int64_t>(at.u);
  if (!(at.depth_m < *centre)) return 0.0f;
  for (int dv = -1; dv <= 1; ++dv) {
    const float* row = centre + static_cast<int64_t>(dv) * frame.width;
    if (!(at.depth_m < row[-1] && at.depth_m < row[0] && at.depth_m < row[1])) return 0.0f;
  }
  const float voxel_px =
      frame.intrinsics.fx * frame.voxel_size_m / maximum(at.depth_m, rules.nearest_free_m);
  return rules.free_share * depthWeight(at.depth_m, surfel_rules) * (voxel_px * voxel_px);
}

/// A voxel after a frame gave it that weight for being free.
DTSDF_HD Voxel clearedVoxel(const Voxel& voxel, float free_weight, const FusionRules& rules) {
  if (voxel.weight > 0.0f && voxel.sdf >= 0.0f) return voxel;
  const float least = minimum(-(rules.most_free_frames * free_weight), voxel.weight);
  const float weight = maximum(voxel.weight - free_weight, least);
  return weight > 0.0f ? Voxel{voxel.sdf, weight}
                       : Voxel{0.0f, minimum(weight, -kLeastNegativeWeight)};
}

}  // namespace dtsdf
