/// A frame's pinhole camera and its local frame.
#pragma once

#include "dtsdf_mapping/pinhole.h"
#include "kernels/core/vec.h"

namespace dtsdf {

/// The camera of one frame. The rules use lengths in voxels relative to `origin_voxel`, so that
/// single precision suffices even in a map several kilometres wide.
struct FrameView {
  int32_t width, height;
  Intrinsics intrinsics;
  RigidTransform T_L_C;  ///< From the camera to the local frame L (parallel to W, in voxels).
  Vec3i origin_voxel;    ///< Origin of L in W; a multiple of the block's side.
  float voxel_size_m;
};

struct Pixel {
  int32_t u, v;
};

/// Index of a pixel in a row-major image without padding.
DTSDF_HD int64_t pixelIndex(const FrameView& frame, const Pixel& pixel) {
  return static_cast<int64_t>(pixel.v) * frame.width + pixel.u;
}

/// The point on a pixel's ray at depth z_m, in the camera's optical frame, in metres. u_px and v_px
/// are measured from the centre of the first pixel.
DTSDF_HD Vec3f backProject(const Intrinsics& K, float u_px, float v_px, float z_m) {
  return {(u_px - K.cx) / K.fx * z_m, (v_px - K.cy) / K.fy * z_m, z_m};
}

/// A voxel's position in the image; valid only if the depth is positive.
struct VoxelInImage {
  float depth_m;
  float u, v;  ///< In pixels; the centre of the first pixel is at (0.5, 0.5).
};

/// Projects a point of the local frame, given in voxels.
DTSDF_HD VoxelInImage projectToImage(const FrameView& frame, const Vec3f& p_L) {
  const Vec3f p_C = frame.voxel_size_m * rotateInverse(frame.T_L_C, p_L - frame.T_L_C.t);
  const Intrinsics& K = frame.intrinsics;
  return {p_C.z, K.fx * p_C.x / p_C.z + K.cx + 0.5f, K.fy * p_C.y / p_C.z + K.cy + 0.5f};
}

/// Bounding box of projected corners, in the image and in depth.
struct ProjectedBounds {
  float near_m, far_m;
  float left, right, top, bottom;  ///< In pixels, as in VoxelInImage.
};

DTSDF_HD ProjectedBounds boundsOf(const VoxelInImage& corner) {
  return {corner.depth_m, corner.depth_m, corner.u, corner.u, corner.v, corner.v};
}
DTSDF_HD ProjectedBounds unite(const ProjectedBounds& a, const ProjectedBounds& b) {
  return {minimum(a.near_m, b.near_m), maximum(a.far_m, b.far_m), minimum(a.left, b.left),
          maximum(a.right, b.right),   minimum(a.top, b.top),     maximum(a.bottom, b.bottom)};
}

/// Whether part of a ball may be in the image; false only if no part is. `middle` is the ball's
/// centre in the local frame; lengths are in voxels.
DTSDF_HD bool mayBeInView(const FrameView& frame, const Vec3f& middle, float radius) {
  const Vec3f p = rotateInverse(frame.T_L_C, middle - frame.T_L_C.t);
  const float z = p.z + radius;
  if (!(z > 0.0f)) return false;
  const Intrinsics& K = frame.intrinsics;
  const float left = (-1.0f - K.cx) / K.fx;
  const float right = (static_cast<float>(frame.width) - K.cx) / K.fx;
  const float top = (-1.0f - K.cy) / K.fy;
  const float bottom = (static_cast<float>(frame.height) - K.cy) / K.fy;
  const auto reaches = [&](float at, float low, float high) {
    // Between depths 0 and z, a ray with slope `low` is leftmost at z if low < 0, otherwise at 0.
    return at + radius >= minimum(low, 0.0f) * z && at - radius <= maximum(high, 0.0f) * z;
  };
  return reaches(p.x, left, right) && reaches(p.y, top, bottom);
}

}  // namespace dtsdf
