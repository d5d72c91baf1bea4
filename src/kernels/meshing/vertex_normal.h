/// Computes unit normals of edge vertices from the gradients of the directions' distances, for
/// refined meshes (refine.h).
///
/// Perpendicular to an edge, the slope is interpolated between the slopes at the edge's two ends.
/// Along the edge, it is the slope of the parabola in edge_vertex.h. Samples are read at the ends
/// and at their neighbours along each axis.
#pragma once

#include "kernels/meshing/edge_vertex.h"

namespace dtsdf {

/// A rate of change per voxel, if known.
struct Slope {
  float value;
  bool is_known;
};

/// Slope of the distance at a known sample, from its neighbours along an axis; one-sided if only
/// one of them is known.
DTSDF_HD Slope slopeAt(const Sample& below, const Sample& own, const Sample& above) {
  const bool knows_below = below.weight > 0.0f, knows_above = above.weight > 0.0f;
  const float low = knows_below ? below.sdf : own.sdf, high = knows_above ? above.sdf : own.sdf;
  return {(knows_below && knows_above ? 0.5f : 1.0f) * (high - low), knows_below || knows_above};
}

/// Slope at t, from 0 to 1, between two corners. If the slope is known at only one corner, that
/// slope is returned.
DTSDF_HD Slope slopeBetween(const Slope& lower, const Slope& upper, float t) {
  if (!lower.is_known || !upper.is_known) return lower.is_known ? lower : upper;
  return {(1.0f - t) * lower.value + t * upper.value, true};
}

/// Gradient of a direction's distance on an edge, t voxels from its lower corner; 0 if a component
/// is unknown. `at(corner)` returns the direction's sample.
template <class At>
DTSDF_HD Vec3f gradientOnEdge(const At& at, const Vec3i& corner, int axis, float t) {
  const Vec3i end = corner + unitStep(axis);
  const Sample lower = at(corner), upper = at(end);
  Vec3f gradient{0.0f, 0.0f, 0.0f};
  for (int i = 0; i < 3; ++i) {
    const Vec3i step = unitStep(i);
    Slope slope{0.0f, true};
    if (i == axis) {
      const float bend = bendOnEdge(at(corner - step), lower, upper, at(end + step));
      slope.value = upper.sdf - lower.sdf + bend * (t - 0.5f);
    } else {
      slope = slopeBetween(slopeAt(at(corner - step), lower, at(corner + step)),
                           slopeAt(at(end - step), upper, at(end + step)), t);
    }
    if (!slope.is_known) return {0.0f, 0.0f, 0.0f};
    gradient = gradient + slope.value * toFloat(step);
  }
  return gradient;
}

/// Unit normal of an edge's vertex, towards free space: the mean gradient of the directions that
/// cross the edge, weighted as in edgeOffset(). 0 if none is known. It is bitwise equal in all
/// blocks that share the vertex.
template <class Corners>
DTSDF_HD Vec3f vertexNormal(const Corners& corners, int edge, const Vec3f& position,
                            bool directional) {
  const Vec3i corner = cornerAt(edgeCorner(edge));
  const int axis = edgeAxis(edge), facing = edgeFacing(edge);
  const float offset = component(position, axis) - component(toFloat(corner), axis);
  const float t = minimum(maximum(offset, 0.0f), 1.0f);
  Vec3f sum{0.0f, 0.0f, 0.0f};
  for (int d = 0; d < (directional ? kDirectionCount : 1); ++d) {
    if (directional && !countsOnEdge(d, axis, facing)) continue;
    const auto at = [&](const Vec3i& place) { return corners.sample(place, d); };
    const Sample lower = at(corner), upper = at(corner + unitStep(axis));
    if (!crosses(lower, upper, facing)) continue;
    sum = sum + lower.weight * upper.weight * gradientOnEdge(at, corner, axis, t);
  }
  const float length = norm(sum);
  return length > 0.0f ? (1.0f / length) * sum : Vec3f{0.0f, 0.0f, 0.0f};
}

}  // namespace dtsdf
