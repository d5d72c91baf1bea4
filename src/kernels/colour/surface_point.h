/// The surface points of voxels, projected into a colour image.
#pragma once

#include "kernels/colour/colour_rules.h"
#include "kernels/core/camera.h"
#include "kernels/fusion/free_space.h"

namespace dtsdf {

/// A voxel's foot (its nearest point on the surface), projected into the image.
struct SurfacePoint {
  float depth_m;
  float cosine;  ///< Between normal and ray to the camera; negative if facing away.
  float u, v;    ///< In pixels, from the corner of the first pixel.
  /// Inverse depth in 1/m, and its change per pixel on the plane through the point.
  float inverse_depth, per_u, per_v;
};

/// The settings and the camera that surface points depend on.
struct PointView : PaintSettings {
  FrameView frame;
  int32_t min_evidence;  ///< Minimum evidence of a known voxel, as in the mesh.
};

/// Whether a voxel is known and near its surface. This cheap test rules out most voxels.
DTSDF_HD bool isNearSurface(const PointView& view, const Voxel& voxel) {
  return (evidenceOf(voxel) >= view.min_evidence) &
         (fabsf(sdfOf(voxel)) <= view.rules.surface_distance);
}

/// Radius, in voxels, of a ball around a block's centre that contains the block's surface points: 7
/// for the block itself, plus the distance of a voxel from its surface.
DTSDF_HD float pointRadius(const ColourRules& rules) { return 7.0f + rules.surface_distance; }

/// Whether a voxel with this normal has a surface point in a direction. The normal must belong to
/// the direction (core/direction.h); in the undirected map, it must not be zero.
DTSDF_HD bool hasPoint(const PointView& view, const Vec3f& normal, int direction) {
  return view.directional ? directionWeight(normal, direction) > 0.0f : dot(normal, normal) > 0.0f;
}

/// Minimum cosine between normal and ray at which the plane around a point is used. Below it, the
/// depth around the point is taken to be constant.
constexpr float kMinPlaneCosine = 0.02f;

/// Projects a point in metres with a unit normal; the result may be outside the image.
DTSDF_HD SurfacePoint projectSurfacePoint(const Intrinsics& K, const Vec3f& p_C,
                                          const Vec3f& normal_C) {
  const float offset = dot(normal_C, p_C), cosine = -offset / norm(p_C);
  const bool has_plane = fabsf(cosine) > kMinPlaneCosine;
  return {p_C.z,
          cosine,
          K.fx * p_C.x / p_C.z + K.cx + 0.5f,
          K.fy * p_C.y / p_C.z + K.cy + 0.5f,
          1.0f / p_C.z,
          has_plane ? normal_C.x / (K.fx * offset) : 0.0f,
          has_plane ? normal_C.y / (K.fy * offset) : 0.0f};
}

/// Projects a foot, given in voxels relative to its block's first voxel.
DTSDF_HD SurfacePoint projectFoot(const FrameView& frame, const Vec3f& first_voxel_L,
                                  const Vec3f& foot, const Vec3f& normal) {
  return projectSurfacePoint(
      frame.intrinsics,
      frame.voxel_size_m * rotateInverse(frame.T_L_C, first_voxel_L + foot - frame.T_L_C.t),
      rotateInverse(frame.T_L_C, normal));
}

DTSDF_HD bool isInImage(const PointView& view, const SurfacePoint& point) {
  const FrameView& frame = view.frame;
  return point.depth_m > frame.voxel_size_m && point.depth_m <= view.max_depth_m &&
         point.u >= 0.0f && point.v >= 0.0f && point.u < static_cast<float>(frame.width) &&
         point.v < static_cast<float>(frame.height);
}

/// Finds the surface point of the voxel at `index` in its array. @return false if its normal does
/// not belong to the direction, or if the point is outside the image, too near or too far away.
DTSDF_HD bool findSurfacePoint(const PointView& view, const Vec3f& first_voxel_L,
                               const Voxel* voxels, int index, int direction, SurfacePoint& point) {
  const Facing facing = facingOf(view.directional ? direction : kAnyDirection);
  const Vec3f normal = gradientOf(slopeAt(voxels, index), facing);
  if (!hasPoint(view, normal, direction)) return false;
  const Vec3f foot = toFloat(voxelOffset(index)) - sdfOf(voxels[index]) * normal;
  point = projectFoot(view.frame, first_voxel_L, foot, normal);
  return isInImage(view, point);
}

/// Width of a voxel in the image, in pixels.
DTSDF_HD float voxelWidth(const FrameView& frame, const SurfacePoint& point) {
  return frame.intrinsics.fx * frame.voxel_size_m / point.depth_m;
}

/// Depth in metres of the plane through a point, at (du, dv) pixels from that point; limited to 100
/// times the point's depth.
DTSDF_HD float depthBeside(const SurfacePoint& point, float du, float dv) {
  const float inverse_depth = point.inverse_depth + du * point.per_u + dv * point.per_v;
  return 1.0f / maximum(inverse_depth, 0.01f * point.inverse_depth);
}

}  // namespace dtsdf
