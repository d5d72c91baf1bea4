/// Which samples a surfel updates when it is cast into the grid, and with what distance and weight.
///
/// The line through the measured point (along the view ray, or along the normal) is followed to both
/// sides. Instead of one nearest corner per step (Amanatides and Woo 1987, as in the paper), it is
/// intersected with each grid plane across its dominant axis, and the four corners around the
/// intersection are updated: samples close to the line count most, both sides of it are covered, and
/// no corner is visited twice. Any plane can be computed on its own, so that a block can process
/// just the part of the line inside it.
///
/// Weights fall with the distance from the line (squared bilinear) and from the measured plane
/// (linear), since the plane stands for the surface near the point only. Both are departures from
/// the paper, measured in docs/results.
#pragma once

#include "dtsdf_mapping/kernels/direction.h"
#include "dtsdf_mapping/kernels/grid.h"
#include "dtsdf_mapping/kernels/surfel.h"
#include "dtsdf_mapping/kernels/voxel.h"

namespace dtsdf {

/// Samples farther than this from the measured plane, in voxels, are left alone: a mesh unit reaches
/// no farther than sqrt(3) voxels from a surface in it, and more would only blur other surfaces.
constexpr float kSampleReach = 1.75f;

/// A line in the grid, its axes permuted so that k is the dominant one: (k, u, v) = (x, y, z),
/// (y, z, x) or (z, x, y).
struct SampleLine {
  int axis;
  float reach;                         ///< In voxels, measured across the surface.
  int first_plane, last_plane;         ///< Grid planes of axis k it crosses within reach.
  float p_k, p_u, p_v;                 ///< Measured point.
  float slope_u, slope_v;              ///< Change of u and v per plane.
  float normal_k, normal_u, normal_v;  ///< Surface normal, for the point-to-plane distance.
};

DTSDF_HD SampleLine makeSampleLine(const Vec3f& p, const Vec3f& normal, const Vec3f& direction,
                                   float truncation_voxels) {
  const float reach = fminf(truncation_voxels, kSampleReach);
  const float ax = fabsf(direction.x), ay = fabsf(direction.y), az = fabsf(direction.z);
  SampleLine line;
  line.axis = ax >= ay && ax >= az ? 0 : (ay >= az ? 1 : 2);
  const int u = line.axis == 2 ? 0 : line.axis + 1, v = u == 2 ? 0 : u + 1;
  const float dk = component(direction, line.axis);
  line.p_k = component(p, line.axis);
  line.p_u = component(p, u);
  line.p_v = component(p, v);
  line.slope_u = component(direction, u) / dk;
  line.slope_v = component(direction, v) / dk;
  line.normal_k = component(normal, line.axis);
  line.normal_u = component(normal, u);
  line.normal_v = component(normal, v);
  line.reach = reach;
  line.first_plane = static_cast<int>(ceilf(line.p_k - reach * fabsf(dk)));
  line.last_plane = static_cast<int>(floorf(line.p_k + reach * fabsf(dk)));
  return line;
}

/// Grid coordinates (k, u, v) of a line back to (x, y, z).
DTSDF_HD Vec3i unpermute(int axis, int k, int u, int v) {
  return axis == 0 ? Vec3i{k, u, v} : (axis == 1 ? Vec3i{v, k, u} : Vec3i{u, v, k});
}

/// Where a line crosses one grid plane: the corner at the lower end of the cell, and the position
/// inside the cell in [0, 1).
struct PlaneCrossing {
  int u, v;
  float fraction_u, fraction_v;
};

DTSDF_HD PlaneCrossing crossPlane(const SampleLine& line, int plane) {
  const float step = static_cast<float>(plane) - line.p_k;
  const float u = line.p_u + step * line.slope_u;
  const float v = line.p_v + step * line.slope_v;
  const float floor_u = floorf(u), floor_v = floorf(v);
  return {static_cast<int>(floor_u), static_cast<int>(floor_v), u - floor_u, v - floor_v};
}

/// Point-to-plane distance of a sample in voxels: (x - p)^T n, positive in front of the surface.
DTSDF_HD float pointToPlane(const SampleLine& line, int k, int u, int v) {
  return (static_cast<float>(k) - line.p_k) * line.normal_k +
         (static_cast<float>(u) - line.p_u) * line.normal_u +
         (static_cast<float>(v) - line.p_v) * line.normal_v;
}

/// Calls visit(voxel, weight in (0, 1], distance in voxels) for the samples of one plane that
/// `accept(u, v)` lets through, in local grid coordinates.
template <class Accept, class Visit>
DTSDF_HD void visitPlane(const SampleLine& line, int plane, const Accept& accept, Visit& visit) {
  const PlaneCrossing at = crossPlane(line, plane);
  for (int corner = 0; corner < 4; ++corner) {
    const int du = corner & 1, dv = corner >> 1;
    const float bilinear = (du ? at.fraction_u : 1.0f - at.fraction_u) *
                           (dv ? at.fraction_v : 1.0f - at.fraction_v);
    if (!(bilinear > 0.0f) || !accept(at.u + du, at.v + dv)) continue;
    const float distance = pointToPlane(line, plane, at.u + du, at.v + dv);
    const float nearness = 1.0f - fabsf(distance) / line.reach;
    if (!(nearness > 0.0f)) continue;
    visit(unpermute(line.axis, plane, at.u + du, at.v + dv), bilinear * bilinear * nearness,
          distance);
  }
}

/// Calls visit(block) for each block that holds samples of a line, in local block coordinates. A
/// block may come up more than once, never twice in a row.
template <class Visit>
DTSDF_HD void visitBlocks(const SampleLine& line, Visit& visit) {
  Vec3i last{INT32_MAX, 0, 0};
  for (int plane = line.first_plane; plane <= line.last_plane; ++plane) {
    const PlaneCrossing at = crossPlane(line, plane);
    for (int corner = 0; corner < 4; ++corner) {
      const int du = corner & 1, dv = corner >> 1;
      if ((du && at.fraction_u == 0.0f) || (dv && at.fraction_v == 0.0f)) continue;
      const Vec3i block = blockOfVoxel(unpermute(line.axis, plane, at.u + du, at.v + dv));
      if (block == last) continue;
      visit(block);
      last = block;
    }
  }
}

}  // namespace dtsdf
