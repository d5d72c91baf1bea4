/// Unit normals of edge vertices, for refined meshes (refine.h), from the gradients of the fields
/// that cross the edge.
///
/// A field's slope across an edge is interpolated between the central differences at the edge's two
/// ends; its slope along the edge is that of the parabola that gave the vertex (edge_vertex.h).
/// Samples are read up to one corner beyond the ends, which is as far as a mesh may depend on its
/// block's surroundings.
#pragma once

#include "kernels/meshing/edge_vertex.h"

namespace dtsdf {

/// A rate of change per voxel, if known.
struct Slope {
  float value;
  bool is_known;
};

/// Slope of a field at a known sample, from its neighbours along an axis; one-sided if only one of
/// them is known.
DTSDF_HD Slope slopeAt(const Sample& below, const Sample& own, const Sample& above) {
  const bool knows_below = below.weight > 0.0f, knows_above = above.weight > 0.0f;
  const float low = knows_below ? below.sdf : own.sdf, high = knows_above ? above.sdf : own.sdf;
  return {(knows_below && knows_above ? 0.5f : 1.0f) * (high - low), knows_below || knows_above};
}

/// Slope at a share t of the way between two corners; if only one is known, its slope.
DTSDF_HD Slope slopeBetween(const Slope& lower, const Slope& upper, float t) {
  if (!lower.is_known || !upper.is_known) return lower.is_known ? lower : upper;
  return {(1.0f - t) * lower.value + t * upper.value, true};
}

/// A vertex's place on an edge of the grid around a block, with a direction's samples at the edge's
/// ends. `corner` is the lower end.
struct PlaceOnEdge {
  Vec3i corner;
  int axis;
  float t;  ///< Share of the edge, from its lower end.
  int direction;
  Sample lower, upper;
};

template <class Corners>
DTSDF_HD Slope slopeAcross(const Corners& corners, const PlaceOnEdge& at, int across) {
  const Vec3i upper = at.corner + gridStep(at.axis, 1);
  const Vec3i down = gridStep(across, -1), up = gridStep(across, 1);
  return slopeBetween(slopeAt(corners.sample(at.corner + down, at.direction), at.lower,
                              corners.sample(at.corner + up, at.direction)),
                      slopeAt(corners.sample(upper + down, at.direction), at.upper,
                              corners.sample(upper + up, at.direction)),
                      at.t);
}

template <class Corners>
DTSDF_HD float slopeAlong(const Corners& corners, const PlaceOnEdge& at) {
  const float bend =
      bendOnEdge(corners.sample(at.corner + gridStep(at.axis, -1), at.direction), at.lower,
                 at.upper, corners.sample(at.corner + gridStep(at.axis, 2), at.direction));
  return at.upper.sdf - at.lower.sdf + bend * (at.t - 0.5f);
}

/// Gradient of a direction's field at a place on an edge; 0 if a component is unknown.
template <class Corners>
DTSDF_HD Vec3f gradientOnEdge(const Corners& corners, const PlaceOnEdge& at) {
  Vec3f gradient{0.0f, 0.0f, 0.0f};
  for (int axis = 0; axis < 3; ++axis) {
    const Slope slope =
        axis == at.axis ? Slope{slopeAlong(corners, at), true} : slopeAcross(corners, at, axis);
    if (!slope.is_known) return {0.0f, 0.0f, 0.0f};
    gradient = gradient + slope.value * toFloat(gridStep(axis, 1));
  }
  return gradient;
}

/// Unit normal of an edge's vertex, towards free space: the mean gradient of the directions that
/// cross the edge, weighted as in edgeOffset(). 0 if none is known. All blocks that share the
/// vertex find the same bits.
template <class Corners>
DTSDF_HD Vec3f vertexNormal(const Corners& corners, int edge, const Vec3f& position,
                            bool directional) {
  const Vec3i corner = cornerAt(edgeCorner(edge));
  const int axis = edgeAxis(edge), facing = edgeFacing(edge);
  const float offset = component(position, axis) - component(toFloat(corner), axis);
  const float t = minimum(maximum(offset, 0.0f), 1.0f);
  Vec3f sum{0.0f, 0.0f, 0.0f};
  for (int d = 0; d < (directional ? kDirectionCount : 1); ++d) {
    if (directional && !speaksOnEdge(d, axis, facing)) continue;
    const PlaceOnEdge at{corner,
                         axis,
                         t,
                         d,
                         corners.sample(corner, d),
                         corners.sample(corner + gridStep(axis, 1), d)};
    if (!crosses(at.lower, at.upper, facing)) continue;
    const float weight = at.lower.weight * at.upper.weight;
    sum = sum + weight * gradientOnEdge(corners, at);
  }
  const float length = norm(sum);
  return length > 0.0f ? (1.0f / length) * sum : Vec3f{0.0f, 0.0f, 0.0f};
}

}  // namespace dtsdf
