/// The six directions of the map and the weight with which a surface normal belongs to each.
#pragma once

#include "kernels/core/vec.h"

namespace dtsdf {

/// X+, X-, Y+, Y-, Z+, Z-: directions 0 to 5. The undirected map keeps everything in direction 0.
constexpr int kDirectionCount = 6;
constexpr uint32_t kAllDirections = (1u << kDirectionCount) - 1u;  ///< As a mask, a bit each.

/// sin(pi/8): a normal belongs to direction D where its cosine to v_D exceeds this (paper,
/// Sec. III). An axis-aligned normal then has one direction, and none has more than three.
constexpr float kDirectionThreshold = 0.38268343f;

DTSDF_HD int directionAxis(int direction) { return direction >> 1; }
DTSDF_HD float directionSign(int direction) { return (direction & 1) ? -1.0f : 1.0f; }

/// <n, v_D>, the cosine between a unit vector and the axis of direction D.
DTSDF_HD float directionCosine(const Vec3f& n, int direction) {
  const float c = component(n, directionAxis(direction));
  return (direction & 1) ? -c : c;
}

/// w_D of the paper: the cosine where the normal belongs to D, otherwise 0.
DTSDF_HD float directionWeight(const Vec3f& n, int direction) {
  const float c = directionCosine(n, direction);
  return c > kDirectionThreshold ? c : 0.0f;
}

/// The directions a measurement with normal n is fused into (at most three) and their weights.
struct DirectionSet {
  int count;
  int direction[3];
  float weight[3];
};

DTSDF_HD DirectionSet directionsOf(const Vec3f& n, bool directional) {
  DirectionSet set{0, {0, 0, 0}, {0.0f, 0.0f, 0.0f}};
  if (!directional) {
    set.count = 1;
    set.weight[0] = 1.0f;
    return set;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const int direction = 2 * axis + (component(n, axis) < 0.0f ? 1 : 0);
    const float weight = directionWeight(n, direction);
    if (weight > 0.0f) {
      set.direction[set.count] = direction;
      set.weight[set.count] = weight;
      ++set.count;
    }
  }
  return set;
}

DTSDF_HD uint32_t directionMask(const DirectionSet& set) {
  uint32_t mask = 0;
  for (int i = 0; i < set.count; ++i) mask |= 1u << set.direction[i];
  return mask;
}

/// Calls visit(direction) for those of a mask, in ascending order. On a GPU by a loop that can be
/// unrolled: what visit() indexes stays in registers.
template <class Visit>
DTSDF_HD void visitDirections(uint32_t mask, const Visit& visit) {
#ifdef __CUDA_ARCH__
  for (int d = 0; d < kDirectionCount; ++d) {
    if (mask >> d & 1u) visit(d);
  }
#else
  for (; mask != 0; mask &= mask - 1) visit(__builtin_ctz(mask));
#endif
}

}  // namespace dtsdf
