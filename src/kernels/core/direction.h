/// The six directions of the map, and the weight of a normal in each direction.
#pragma once

#include "kernels/core/vec.h"

namespace dtsdf {

/// X+, X-, Y+, Y-, Z+, Z-: directions 0 to 5. The undirected map has only direction 0.
constexpr int kDirectionCount = 6;
/// All directions as a mask, bit d for direction d.
constexpr uint32_t kAllDirections = (1u << kDirectionCount) - 1u;

/// sin(pi/8): a normal belongs to direction D if its cosine to the axis v_D exceeds this (paper,
/// Sec. III). A normal belongs to at most three directions.
constexpr float kDirectionThreshold = 0.38268343f;

DTSDF_HD int directionAxis(int direction) { return direction >> 1; }
DTSDF_HD float directionSign(int direction) { return (direction & 1) ? -1.0f : 1.0f; }

/// <n, v_D>, the cosine between a unit vector and the axis of direction D.
DTSDF_HD float directionCosine(const Vec3f& n, int direction) {
  const float c = component(n, directionAxis(direction));
  return (direction & 1) ? -c : c;
}

/// w_D of the paper: the cosine if the normal belongs to D, otherwise 0.
DTSDF_HD float directionWeight(float cosine) {
  return cosine > kDirectionThreshold ? cosine : 0.0f;
}
DTSDF_HD float directionWeight(const Vec3f& n, int direction) {
  return directionWeight(directionCosine(n, direction));
}

/// The directions (at most three) into which a measurement is fused, with their weights.
struct DirectionSet {
  int count;
  int direction[3];
  float weight[3];
};

/// The directions of normal n, in the order of their axes; in the undirected map, direction 0 with
/// weight 1. No branch depends on n, so that compilers can vectorise loops that call this function.
DTSDF_HD DirectionSet directionsOf(const Vec3f& n, bool directional) {
  if (!directional) return {1, {0, 0, 0}, {1.0f, 0.0f, 0.0f}};
  const float of_x = directionWeight(fabsf(n.x)), of_y = directionWeight(fabsf(n.y)),
              of_z = directionWeight(fabsf(n.z));
  const int x = n.x < 0.0f ? 1 : 0, y = n.y < 0.0f ? 3 : 2, z = n.z < 0.0f ? 5 : 4;
  const int has_x = of_x > 0.0f ? 1 : 0, has_y = of_y > 0.0f ? 1 : 0, has_z = of_z > 0.0f ? 1 : 0;
  const int before_z = has_x + has_y;
  return {before_z + has_z,
          {has_x != 0 ? x : (has_y != 0 ? y : z), before_z == 2 ? y : z, z},
          {has_x != 0 ? of_x : (has_y != 0 ? of_y : of_z),
           before_z == 2 ? of_y : (before_z == 1 ? of_z : 0.0f), before_z == 2 ? of_z : 0.0f}};
}

DTSDF_HD uint32_t directionMask(const DirectionSet& set) {
  uint32_t mask = 0;
  for (int i = 0; i < set.count; ++i) mask |= 1u << set.direction[i];
  return mask;
}

/// Calls visit(direction) for each direction of a mask, in ascending order. On the GPU the loop is
/// unrolled, so that arrays indexed in visit() stay in registers.
template <class Visit>
DTSDF_HD void visitDirections(uint32_t mask, const Visit& visit) {
#ifdef __CUDA_ARCH__
#pragma unroll
  for (int d = 0; d < kDirectionCount; ++d) {
    if (mask >> d & 1u) visit(d);
  }
#else
  for (; mask != 0; mask &= mask - 1) visit(__builtin_ctz(mask));
#endif
}

}  // namespace dtsdf
