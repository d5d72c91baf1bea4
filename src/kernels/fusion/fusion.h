/// Fusion of one surfel, or of one voxel, into the sums of a frame: the paper's modes in one place.
#pragma once

#include "kernels/fusion/ray_casting.h"

namespace dtsdf {

/// What the rules need to know of the settings.
struct FusionView {
  int32_t cast_along_normal;  ///< Else along the view ray.
  int32_t directional;
  float truncation_voxels;
  float max_weight;
  float noise;  ///< Standard deviation of the frame's inverse depth, in 1/m.
};

/// The line that a surfel is cast along.
DTSDF_HD SampleLine castSurfel(const FrameView& frame, const FusionView& fusion,
                               const Surfel& surfel) {
  Vec3f direction = surfel.normal_L;
  if (!fusion.cast_along_normal) {
    const Vec3f ray = surfel.p_L - frame.T_L_C.t;
    direction = (1.0f / norm(ray)) * ray;
  }
  const float noise_voxels = fusion.noise * surfel.depth_m * surfel.depth_m / frame.voxel_size_m;
  return makeSampleLine(surfel.p_L, surfel.normal_L, direction,
                        sampleReach(fusion.truncation_voxels, noise_voxels));
}

/// A surfel ready to be cast: its line, its directions, and the fixed-point weight in each.
struct CastLine {
  SampleLine line;
  DirectionSet directions;
};

DTSDF_HD CastLine makeCastLine(const FrameView& frame, const FusionView& fusion,
                               const Surfel& surfel) {
  CastLine cast{castSurfel(frame, fusion, surfel),
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

/// Adds the part of a surfel that lies inside one block to the block's sums. `add(direction, voxel
/// index, weight, sdf)` takes fixed-point values. kPlanes planes are worked out at a time.
template <int kPlanes, class Add>
DTSDF_HD void castIntoBlock(const CastLine& cast, const FusionView& fusion, const Vec3i& block_L,
                            Add& add) {
  const SampleLine& line = cast.line;
  const Vec3i first = firstVoxelOfBlock(block_L);
  const int k0 = component(first, line.axis);
  const int u_axis = line.axis == 2 ? 0 : line.axis + 1, v_axis = u_axis == 2 ? 0 : u_axis + 1;
  const int u0 = component(first, u_axis), v0 = component(first, v_axis);
  const int begin = line.first_plane > k0 ? line.first_plane : k0;
  const int end = line.last_plane < k0 + kBlockSide - 1 ? line.last_plane : k0 + kBlockSide - 1;
  const VoxelStrides strides = stridesOf(line.axis);
  const float sdf_scale = kSdfScale / fusion.truncation_voxels;
  for (int plane = begin; plane <= end; plane += kPlanes) {
    PlaneSamples<kPlanes> samples;
    samplePlanes(line, plane, samples);
    int32_t sdf[4][kPlanes], weight[3][4][kPlanes];
    for (int corner = 0; corner < 4; ++corner) {
      for (int i = 0; i < kPlanes; ++i) {
        sdf[corner][i] = roundSdf(samples.distance[corner][i] * sdf_scale);
      }
    }
    for (int d = 0; d < cast.directions.count; ++d) {
      for (int corner = 0; corner < 4; ++corner) {
        for (int i = 0; i < kPlanes; ++i) {
          weight[d][corner][i] =
              roundWeight(samples.share[corner][i] * cast.directions.weight[d]);
        }
      }
    }
    for (int i = 0; i < kPlanes && plane + i <= end; ++i) {
      const int u = samples.u[i] - u0, v = samples.v[i] - v0;
      const int index = (plane + i - k0) * strides.k + u * strides.u + v * strides.v;
      constexpr uint32_t kLast = kBlockSide - 1;
      const bool all_inside = static_cast<uint32_t>(u) < kLast && static_cast<uint32_t>(v) < kLast;
      for (int corner = 0; corner < 4; ++corner) {
        const int du = corner & 1, dv = corner >> 1;
        const bool inside = all_inside || (static_cast<uint32_t>(u + du) <= kLast &&
                                           static_cast<uint32_t>(v + dv) <= kLast);
        if (!inside) continue;
        for (int d = 0; d < cast.directions.count; ++d) {
          add(cast.directions.direction[d], index + du * strides.u + dv * strides.v,
              weight[d][corner][i], sdf[corner][i]);
        }
      }
    }
  }
}

/// Voxel projection: the projective distance of a voxel to the pixel that it falls on (Curless and
/// Levoy 1996; the paper's VP). `add(direction, weight, sdf)` takes fixed-point values.
template <class Add>
DTSDF_HD void projectVoxel(const FrameView& frame, const FusionView& fusion, const Surfel* surfels,
                           const Vec3i& voxel_L, Add& add) {
  const VoxelInImage at = projectToImage(frame, voxel_L);
  if (!(at.depth_m > 0.0f && at.u >= 0.0f && at.v >= 0.0f &&
        at.u < static_cast<float>(frame.width) && at.v < static_cast<float>(frame.height))) {
    return;
  }
  const Surfel& surfel =
      surfels[static_cast<int64_t>(at.v) * frame.width + static_cast<int64_t>(at.u)];
  if (!(surfel.weight > 0.0f)) return;
  const float distance = (surfel.depth_m - at.depth_m) / frame.voxel_size_m;
  if (distance < -fusion.truncation_voxels) return;
  const int32_t sdf = quantiseSdf(distance / fusion.truncation_voxels);
  const DirectionSet directions = directionsOf(surfel.normal_L, fusion.directional != 0);
  for (int i = 0; i < directions.count; ++i) {
    const int32_t weight = quantiseWeight(surfel.weight * directions.weight[i]);
    if (weight > 0) add(directions.direction[i], weight, sdf);
  }
}

}  // namespace dtsdf
