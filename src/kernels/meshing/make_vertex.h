/// A vertex on an edge of a block: the rules of edge_vertex.h and anchoring.h, one after the other.
#pragma once

#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/anchoring.h"

namespace dtsdf {

/// Samples beyond an end of an edge, of which few are asked for: they are read then.
struct SamplesBeyond {
  const ArraysAround& arrays;
  Vec3i corner;
  bool directional;

  DTSDF_HD Sample operator[](int d) const { return arrays.sample(corner, directional ? d : 0); }
};

/// An edge of the corner grid as the rules want it. The undirected map's only array counts as the
/// direction that the edge faces.
struct EdgeSamples {
  Sample lower[kDirectionCount] = {}, upper[kDirectionCount] = {};
  SamplesBeyond below, above;

  DTSDF_HD EdgeSamples(const ArraysAround& arrays, const Vec3i& corner, int axis, bool directional)
      : below{arrays, corner - unitStep(axis), directional},
        above{arrays, corner + gridStep(axis, 2), directional} {}
};

/// The vertex of an edge; in the directional map held to what was measured. `crossing` is from
/// crossingDirections(); `anchors(end, direction)` gives that of the lower (0) or the upper end.
template <class Anchors>
DTSDF_HD BlockVertex makeVertex(const MeshSettings& rules, const EdgeSamples& samples,
                                uint32_t crossing, const Anchors& anchors, int edge,
                                bool directional) {
  const int axis = edgeAxis(edge), facing = edgeFacing(edge);
  const float offset = edgeOffset(rules, samples, crossing, axis, facing);
  Vec3f position = vertexPosition(edge, offset);
  if (directional) {
    position = position + anchoringShift(rules, samples, crossing, anchors, axis, facing, offset);
  }
  return {position, static_cast<uint32_t>(edge)};
}

}  // namespace dtsdf
