/// Casts a surfel: adds it to a frame's sums along a line, in either of the paper's two ray casting
/// modes.
#pragma once

#include "kernels/core/direction.h"
#include "kernels/core/voxel.h"
#include "kernels/fusion/sample_line.h"

namespace dtsdf {

/// The unit vector along which a point most likely deviates from the surface whose normal is n. Its
/// direction is that of C n, where C = I + sigma^2 r r^T is the point's covariance in voxels: a
/// point may represent any place within a voxel, and its depth has the error sigma, `noise_voxels`,
/// along the unit ray r. `ray` is a multiple of r.
///
/// So an exact point is cast along its normal, and a very noisy point along its ray. Along the ray,
/// errors average out even if the normal is wrong, for instance at an edge that a wide window has
/// smoothed.
DTSDF_HD Vec3f castDirection(const Vec3f& normal, const Vec3f& ray, float noise_voxels) {
  const float along_ray = noise_voxels * noise_voxels * dot(normal, ray) / dot(ray, ray);
  const Vec3f C_n = normal + along_ray * ray;
  return (1.0f / norm(C_n)) * C_n;
}

/// The line along which a surfel is cast. It extends by sampleReach() in both directions.
DTSDF_HD SampleLine sampleLineOf(const Surfel& surfel, const FrameSensing& sensing,
                                 const FusionSettings& fusion) {
  const float noise_voxels = noiseInVoxels(sensing, surfel.depth_m);
  const Vec3f ray = surfel.p_L - sensing.image.frame.T_L_C.t;
  const Vec3f direction = fusion.cast_along_normal
                              ? castDirection(surfel.normal_L, ray, noise_voxels)
                              : (1.0f / norm(ray)) * ray;
  return makeSampleLine(surfel.p_L, surfel.normal_L, direction, sampleReach(noise_voxels, fusion));
}

/// Components of a vector along the axes (k, u, v) of a line whose dominant axis is `axis`.
DTSDF_HD Vec3f permute(const Vec3f& v, int axis) {
  return axis == 0 ? v : (axis == 1 ? Vec3f{v.y, v.z, v.x} : Vec3f{v.z, v.x, v.y});
}

/// The vector in a surfel's plane, in voxels, that corresponds to a step of `pixels` along the
/// image axis `axis_C`.
DTSDF_HD Vec3f stepOnPlane(const Surfel& surfel, const FrameView& frame, const Vec3f& axis_C,
                           float focal_px, float pixels) {
  const Vec3f ray = surfel.p_L - frame.T_L_C.t, axis_L = rotate(frame.T_L_C, axis_C);
  const float width = pixels * surfel.depth_m / (focal_px * frame.voxel_size_m);
  const float slope = dot(surfel.normal_L, axis_L) / dot(surfel.normal_L, ray);
  return width * (axis_L - slope * ray);
}

DTSDF_HD float inverseSquaredLength(const Vec3f& side) {
  const float square = dot(side, side);
  return square > 0.0f ? 1.0f / square : 0.0f;
}

/// Whether a surfel stands for an area rather than a point.
DTSDF_HD bool isWide(const Surfel& surfel) {
  return surfel.half_across_px + surfel.half_down_px > 0.0f;
}

DTSDF_HD MeasuredSides measuredSides(const Surfel& surfel, const FrameView& frame, int axis) {
  if (!isWide(surfel)) return noSides();
  const Intrinsics& K = frame.intrinsics;
  const Vec3f across = stepOnPlane(surfel, frame, {1.0f, 0.0f, 0.0f}, K.fx, surfel.half_across_px);
  const Vec3f down = stepOnPlane(surfel, frame, {0.0f, 1.0f, 0.0f}, K.fy, surfel.half_down_px);
  return {permute(across, axis), permute(down, axis), inverseSquaredLength(across),
          inverseSquaredLength(down)};
}

/// The directions into which a surfel is cast, with its weights in units of 2^-20.
DTSDF_HD DirectionSet lineDirections(const Surfel& surfel, bool directional) {
  DirectionSet directions = directionsOf(surfel.normal_L, directional);
  for (int i = 0; i < 3; ++i) directions.weight[i] *= surfel.weight * kWeightScale;
  return directions;
}

/// A block, in the axes (k, u, v) of lines with a given dominant axis.
struct BlockFrame {
  int k0, u0, v0;                    ///< The block's first voxel.
  int stride_k, stride_u, stride_v;  ///< Memory strides between neighbouring voxels.
};

DTSDF_HD BlockFrame blockFrameOf(int axis, const Vec3i& block_L) {
  const Vec3i first = firstVoxelOfBlock(block_L);
  const Vec3i strides{1, kBlockSide, kBlockSide * kBlockSide};
  const int u_axis = axis == 2 ? 0 : axis + 1, v_axis = u_axis == 2 ? 0 : u_axis + 1;
  return {component(first, axis),   component(first, u_axis),   component(first, v_axis),
          component(strides, axis), component(strides, u_axis), component(strides, v_axis)};
}

/// The range of a line's planes that lies inside a block.
DTSDF_HD Span planesInside(const Span& planes, const BlockFrame& block) {
  const int end = block.k0 + kBlockSide - 1;
  return {planes.first > block.k0 ? planes.first : block.k0, planes.last < end ? planes.last : end};
}

DTSDF_HD float sdfScale(const FusionSettings& fusion) {
  return kSdfScale / fusion.truncation_voxels;
}

template <bool kHasSides, class Add>
DTSDF_HD void castPlanes(const SampleLine& line, const MeasuredSides& sides,
                         const FusionSettings& fusion, Add& add) {
  const Vec3i shifts = pointShifts(line.axis);
  for (int plane = line.first_plane; plane <= line.last_plane; ++plane) {
    const CellCrossing crossing = crossCell(line, plane);
    for (int corner = 0; corner < 4; ++corner) {
      const int du = corner >> 1, dv = (corner ^ du) & 1;  // around the cell
      const CornerSample sample = sampleCorner<kHasSides>(line, sides, shifts, crossing, du, dv);
      if (!(sample.share > 0.0f)) continue;
      add(unpermute(line.axis, plane, crossing.u + du, crossing.v + dv), sample,
          roundSdf(sample.distance * sdfScale(fusion)));
    }
  }
}

/// Calls add(voxel, sample, sdf) for each of a surfel's samples with a positive weight: `voxel` is
/// in local coordinates, `sdf` in fixed point. Consecutive samples are often in the same block.
template <class Add>
DTSDF_HD void castSurfel(const SampleLine& line, const MeasuredSides& sides,
                         const FusionSettings& fusion, Add& add) {
  if (sides.areMeasured()) {
    castPlanes<true>(line, sides, fusion, add);
  } else {
    castPlanes<false>(line, sides, fusion, add);
  }
}

}  // namespace dtsdf
