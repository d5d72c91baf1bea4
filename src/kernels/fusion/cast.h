/// Casting one surfel into the sums of a frame: the paper's modes that cast rays.
#pragma once

#include "kernels/core/direction.h"
#include "kernels/core/voxel.h"
#include "kernels/fusion/sample_line.h"

namespace dtsdf {

/// A surfel ready to be cast: its line, its directions, and the fixed-point weight in each.
struct CastLine {
  SampleLine line;
  DirectionSet directions;
};

/// The line that a surfel is cast along.
DTSDF_HD SampleLine sampleLineOf(const Surfel& surfel, const FrameSensing& sensing,
                                 const FusionSettings& fusion) {
  Vec3f direction = surfel.normal_L;
  if (!fusion.cast_along_normal) {
    const Vec3f ray = surfel.p_L - sensing.image.frame.T_L_C.t;
    direction = (1.0f / norm(ray)) * ray;
  }
  return makeSampleLine(surfel.p_L, surfel.normal_L, direction,
                        sampleReach(noiseInVoxels(sensing, surfel.depth_m), fusion));
}

DTSDF_HD CastLine makeCastLine(const Surfel& surfel, const FrameSensing& sensing,
                               const FusionSettings& fusion) {
  CastLine cast{sampleLineOf(surfel, sensing, fusion),
                directionsOf(surfel.normal_L, fusion.directional != 0)};
  for (int i = 0; i < 3; ++i) cast.directions.weight[i] *= surfel.weight * kWeightScale;
  return cast;
}

/// How far apart in a block's memory neighbours along the axes k, u and v of a line lie.
struct VoxelStrides {
  int k, u, v;
};

DTSDF_HD VoxelStrides stridesOf(int axis) {
  constexpr int kX = 1, kY = kBlockSide, kZ = kBlockSide * kBlockSide;
  return axis == 0 ? VoxelStrides{kX, kY, kZ}
                   : (axis == 1 ? VoxelStrides{kY, kZ, kX} : VoxelStrides{kZ, kX, kY});
}

/// Where the axes of lines along one axis lie in a block.
struct BlockFrame {
  int k0, u0, v0;  ///< The block's first voxel along the lines' axes.
  VoxelStrides strides;
};

DTSDF_HD BlockFrame blockFrameOf(int axis, const Vec3i& block_L) {
  const Vec3i first = firstVoxelOfBlock(block_L);
  const int u_axis = axis == 2 ? 0 : axis + 1, v_axis = u_axis == 2 ? 0 : u_axis + 1;
  return {component(first, axis), component(first, u_axis), component(first, v_axis),
          stridesOf(axis)};
}

/// The line's planes inside a block.
DTSDF_HD Span planesInside(const SampleLine& line, const BlockFrame& block) {
  const int end = block.k0 + kBlockSide - 1;
  return {line.first_plane > block.k0 ? line.first_plane : block.k0,
          line.last_plane < end ? line.last_plane : end};
}

/// Samples in fixed point, by corner and plane; weights by direction as well.
template <int kPlanes>
struct RoundedSamples {
  int32_t sdf[4][kPlanes], weight[3][4][kPlanes];
};

/// Rounds the samples of plane i for so many directions of a surfel.
template <int kPlanes>
DTSDF_HD void roundSamples(const PlaneSamples<kPlanes>& samples, int i, float sdf_scale,
                           const float (&direction_weight)[3], int directions,
                           RoundedSamples<kPlanes>& rounded) {
  for (int corner = 0; corner < 4; ++corner) {
    rounded.sdf[corner][i] = roundSdf(samples.distance[corner][i] * sdf_scale);
    for (int d = 0; d < directions; ++d) {
      rounded.weight[d][corner][i] =
          roundWeight(samples.share[corner][i] * direction_weight[d]);
    }
  }
}

DTSDF_HD float sdfScale(const FusionSettings& fusion) {
  return kSdfScale / fusion.truncation_voxels;
}

/// Adds those samples of plane i that lie in a block to the block's sums: `add(direction, voxel
/// index, weight, sdf, point key)` takes fixed-point values.
template <int kPlanes, class Add>
DTSDF_HD void addPlane(const DirectionSet& directions, const BlockFrame& block, int plane, int i,
                       const PlaneSamples<kPlanes>& samples,
                       const RoundedSamples<kPlanes>& rounded, Add& add) {
  const VoxelStrides& strides = block.strides;
  const int u = samples.u[i] - block.u0, v = samples.v[i] - block.v0;
  const int index = (plane - block.k0) * strides.k + u * strides.u + v * strides.v;
  constexpr uint32_t kLast = kBlockSide - 1;
  const bool all_inside = static_cast<uint32_t>(u) < kLast && static_cast<uint32_t>(v) < kLast;
  for (int corner = 0; corner < 4; ++corner) {
    const int du = corner & 1, dv = corner >> 1;
    const bool inside = all_inside || (static_cast<uint32_t>(u + du) <= kLast &&
                                       static_cast<uint32_t>(v + dv) <= kLast);
    if (!inside) continue;
    for (int d = 0; d < directions.count; ++d) {
      add(directions.direction[d], index + du * strides.u + dv * strides.v,
          rounded.weight[d][corner][i], rounded.sdf[corner][i], samples.point_key[corner][i]);
    }
  }
}

/// Adds the part of a surfel that lies inside one block to the block's sums.
template <class Add>
DTSDF_HD void castIntoBlock(const CastLine& cast, const FusionSettings& fusion,
                            const Vec3i& block_L, Add& add) {
  const BlockFrame block = blockFrameOf(cast.line.axis, block_L);
  const Span planes = planesInside(cast.line, block);
  const Vec3i shifts = pointShifts(cast.line.axis);
  for (int plane = planes.first; plane <= planes.last; ++plane) {
    PlaneSamples<1> samples;
    RoundedSamples<1> rounded;
    samplePlane(cast.line, shifts, plane, 0, samples);
    roundSamples(samples, 0, sdfScale(fusion), cast.directions.weight, cast.directions.count,
                 rounded);
    addPlane(cast.directions, block, plane, 0, samples, rounded, add);
  }
}

}  // namespace dtsdf
