/// The pinhole camera, the depth encodings, and the local frame in which one image is fused.
#pragma once

#include "dtsdf_mapping/pinhole.h"
#include "kernels/core/vec.h"

namespace dtsdf {

/// What the rules need to know of one frame. Lengths inside the rules are in voxels, relative to
/// `origin_voxel`, so that single precision suffices anywhere in a map of kilometres.
struct FrameView {
  int32_t width, height;
  Intrinsics intrinsics;
  RigidTransform T_L_C;  ///< Camera to the local frame L: axes of W, origin at `origin_voxel`, voxels.
  Vec3i origin_voxel;    ///< Origin of L, a multiple of the block's side.
  float voxel_size_m;
};

/// Inverse depth of a raw value in 1/m, or 0 where it is no measurement in [min, max].
DTSDF_HD float inverseDepth(float raw, float unit_m, float min_depth_m, float max_depth_m) {
  const float depth_m = raw * unit_m;
  const bool usable = depth_m >= min_depth_m && depth_m <= max_depth_m;  // false for NaN
  return usable ? 1.0f / depth_m : 0.0f;
}

/// The point at depth z_m of a pixel, in the camera's optical frame, in metres.
DTSDF_HD Vec3f backProject(const Intrinsics& K, float u_px, float v_px, float z_m) {
  return {(u_px - K.cx) / K.fx * z_m, (v_px - K.cy) / K.fy * z_m, z_m};
}

/// Where a voxel is seen. Of use only if the depth is above 0.
struct VoxelInImage {
  float depth_m, u, v;  ///< Pixel coordinates, from the corner of the first pixel.
};

DTSDF_HD VoxelInImage projectToImage(const FrameView& frame, const Vec3i& voxel_L) {
  const Vec3f p_C = frame.voxel_size_m *
                    rotateInverse(frame.T_L_C, toFloat(voxel_L) - frame.T_L_C.t);
  const Intrinsics& K = frame.intrinsics;
  return {p_C.z, K.fx * p_C.x / p_C.z + K.cx + 0.5f, K.fy * p_C.y / p_C.z + K.cy + 0.5f};
}

}  // namespace dtsdf
