/// A measured surface point with its normal and weight: what fusion knows of a pixel.
#pragma once

#include "dtsdf_mapping/kernels/camera.h"
#include "dtsdf_mapping/kernels/normal_estimation.h"

namespace dtsdf {

/// Point and unit normal in the frame's local frame L, in voxels. Weight 0: no measurement.
struct Surfel {
  Vec3f p_L;
  float weight;
  Vec3f normal_L;
  float depth_m;
};

/// Depth weight: the noise of triangulating depth cameras grows with z^2, and a weight is the
/// inverse of a standard deviation, so min(1, (1 m / z)^2). (The authors' later work uses the same
/// shape with the sensor's nearest depth in place of 1 m.)
DTSDF_HD float depthWeight(float depth_m) {
  return depth_m <= 1.0f ? 1.0f : 1.0f / (depth_m * depth_m);
}

/// Angle weight: cosine between the view ray and the normal (paper, Sec. IV-A).
DTSDF_HD float angleWeight(const Vec3f& p_C, const Vec3f& normal_C) {
  const float cosine = -dot(p_C, normal_C) / norm(p_C);
  return cosine > 0.0f ? cosine : 0.0f;
}

DTSDF_HD Surfel makeSurfel(const FrameView& frame, int u, int v, float depth_m,
                           const Vec3f& normal_C) {
  const Vec3f p_C = backProject(frame.intrinsics, static_cast<float>(u), static_cast<float>(v),
                                depth_m);
  const Vec3f p_voxels = (1.0f / frame.voxel_size_m) * p_C;
  return {transform(frame.T_L_C, p_voxels), depthWeight(depth_m) * angleWeight(p_C, normal_C),
          rotate(frame.T_L_C, normal_C), depth_m};
}

/// A measurement without a normal: all that the undirected map needs for voxel projection.
DTSDF_HD Surfel makePoint(const FrameView& frame, int u, int v, float depth_m) {
  const Vec3f p_C = backProject(frame.intrinsics, static_cast<float>(u), static_cast<float>(v),
                                depth_m);
  return {transform(frame.T_L_C, (1.0f / frame.voxel_size_m) * p_C), depthWeight(depth_m),
          {0.0f, 0.0f, 0.0f}, depth_m};
}

/// The surfel of a pixel, from the images of inverse depth and of the row fits.
DTSDF_HD Surfel computeSurfel(const FrameView& frame, const float* inverse_depth,
                              const float* row_value, const float* row_slope, int u, int v,
                              const NormalFitSettings& settings) {
  const int64_t i = static_cast<int64_t>(v) * frame.width + u;
  const Surfel none{{0.0f, 0.0f, 0.0f}, 0.0f, {0.0f, 0.0f, 0.0f}, 0.0f};
  if (!(inverse_depth[i] > 0.0f)) return none;
  if (settings.radius_px == 0) return makePoint(frame, u, v, 1.0f / inverse_depth[i]);
  const Vec3f normal_C = fitNormal(row_value, row_slope, frame.width, frame.height, u, v,
                                   frame.intrinsics, settings);
  if (!(dot(normal_C, normal_C) > 0.0f)) return none;
  return makeSurfel(frame, u, v, 1.0f / inverse_depth[i], normal_C);
}

}  // namespace dtsdf
