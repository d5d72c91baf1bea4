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

/// Where a line's axes lie in a block.
struct BlockFrame {
  int k0, u0, v0;  ///< The block's first voxel along the line's axes.
  Span planes;     ///< The line's planes inside the block.
  VoxelStrides strides;
};

DTSDF_HD BlockFrame blockFrameOf(const SampleLine& line, const Vec3i& block_L) {
  const Vec3i first = firstVoxelOfBlock(block_L);
  const int k0 = component(first, line.axis), end = k0 + kBlockSide - 1;
  const int u_axis = line.axis == 2 ? 0 : line.axis + 1, v_axis = u_axis == 2 ? 0 : u_axis + 1;
  return {k0,
          component(first, u_axis),
          component(first, v_axis),
          {line.first_plane > k0 ? line.first_plane : k0,
           line.last_plane < end ? line.last_plane : end},
          stridesOf(line.axis)};
}

/// Distances of some planes' samples in fixed point, by corner and plane.
template <int kPlanes>
DTSDF_HD void roundDistances(const PlaneSamples<kPlanes>& samples, float sdf_scale,
                             int32_t (&sdf)[4][kPlanes]) {
  for (int corner = 0; corner < 4; ++corner) {
    for (int i = 0; i < kPlanes; ++i) {
      sdf[corner][i] = roundSdf(samples.distance[corner][i] * sdf_scale);
    }
  }
}

/// Their weights by direction as well.
template <int kPlanes>
DTSDF_HD void roundWeights(const PlaneSamples<kPlanes>& samples, const DirectionSet& directions,
                           int32_t (&weight)[3][4][kPlanes]) {
  for (int d = 0; d < directions.count; ++d) {
    for (int corner = 0; corner < 4; ++corner) {
      for (int i = 0; i < kPlanes; ++i) {
        weight[d][corner][i] = roundWeight(samples.share[corner][i] * directions.weight[d]);
      }
    }
  }
}

/// Adds the part of a surfel that lies inside one block to the block's sums. `add(direction, voxel
/// index, weight, sdf, point key)` takes fixed-point values. kPlanes planes are worked out at a
/// time.
template <int kPlanes, class Add>
DTSDF_HD void castIntoBlock(const CastLine& cast, const FusionSettings& fusion,
                            const Vec3i& block_L, Add& add) {
  const BlockFrame block = blockFrameOf(cast.line, block_L);
  const VoxelStrides& strides = block.strides;
  const float sdf_scale = kSdfScale / fusion.truncation_voxels;
  for (int plane = block.planes.first; plane <= block.planes.last; plane += kPlanes) {
    PlaneSamples<kPlanes> samples;
    samplePlanes(cast.line, plane, samples);
    int32_t sdf[4][kPlanes], weight[3][4][kPlanes];
    roundDistances(samples, sdf_scale, sdf);
    roundWeights(samples, cast.directions, weight);
    for (int i = 0; i < kPlanes && plane + i <= block.planes.last; ++i) {
      const int u = samples.u[i] - block.u0, v = samples.v[i] - block.v0;
      const int index = (plane + i - block.k0) * strides.k + u * strides.u + v * strides.v;
      constexpr uint32_t kLast = kBlockSide - 1;
      const bool all_inside = static_cast<uint32_t>(u) < kLast && static_cast<uint32_t>(v) < kLast;
      for (int corner = 0; corner < 4; ++corner) {
        const int du = corner & 1, dv = corner >> 1;
        const bool inside = all_inside || (static_cast<uint32_t>(u + du) <= kLast &&
                                           static_cast<uint32_t>(v + dv) <= kLast);
        if (!inside) continue;
        for (int d = 0; d < cast.directions.count; ++d) {
          add(cast.directions.direction[d], index + du * strides.u + dv * strides.v,
              weight[d][corner][i], sdf[corner][i], samples.point_key[corner][i]);
        }
      }
    }
  }
}

}  // namespace dtsdf
