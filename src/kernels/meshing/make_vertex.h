/// Computes the vertex on an edge of a block, by the rules in edge_vertex.h and anchoring.h.
#pragma once

#include "dtsdf_mapping/block_mesh.h"
#include "kernels/meshing/anchoring.h"

namespace dtsdf {

/// An edge of the corner grid with its samples: an Edge as in edge_vertex.h. An undirected map's
/// only array is treated as the edge's facingDirection().
struct EdgeSamples {
  const ArraysAround& arrays;
  Vec3i corner;
  int axis;
  bool directional;
  Sample lower[kDirectionCount], upper[kDirectionCount];

  /// Copies the corner member by member: it has just been written member by member, so a wider load
  /// would stall until those stores are done.
  DTSDF_HD EdgeSamples(const ArraysAround& arrays, const Vec3i& corner, int axis, bool directional)
      : arrays(arrays),
        corner{corner.x, corner.y, corner.z},
        axis(axis),
        directional(directional) {}

  /// Reads the sample beyond an end on demand, as few directions need it.
  DTSDF_HD Sample beyond(int end, int d) const {
    return arrays.sample(corner + gridStep(axis, end == 0 ? -1 : 2), directional ? d : 0);
  }
};

/// Position of an edge's vertex, in voxels relative to the block's first voxel; anchored in a
/// directional map.
/// @param read Mask of directions whose samples are read in a directional map. It must include the
/// directions in directionsOnEdge() that cross the edge or, if none crosses it, all of
/// directionsOnEdge().
DTSDF_HD Vec3f placeVertex(const MeshSettings& rules, const ArraysAround& arrays, int edge,
                           bool directional, uint32_t read) {
  const int axis = edgeAxis(edge), facing = edgeFacing(edge);
  const Vec3i lower = cornerAt(edgeCorner(edge)), upper = lower + unitStep(axis);
  EdgeSamples samples(arrays, lower, axis, directional);
  if (!directional) {
    for (int d = 0; d < kDirectionCount; ++d) samples.lower[d] = samples.upper[d] = {};
  }
  const Voxel* const* const arrays_at[] = {arrays.array[blockAround(lower)],
                                           arrays.array[blockAround(upper)]};
  const int index_at[] = {indexInBlock(lower), indexInBlock(upper)};
  const auto voxel = [&](int end, int array) {
    const Voxel* voxels = arrays_at[end][array];
    return voxels == nullptr ? Voxel{0, kNoAnchor, 0} : voxels[index_at[end]];
  };
  uint32_t crossing = 0;
  visitDirections(directional ? read : 1u << facingDirection(axis, facing), [&](int d) {
    const Sample a = sampleOf(voxel(0, directional ? d : 0), arrays.min_evidence);
    const Sample b = sampleOf(voxel(1, directional ? d : 0), arrays.min_evidence);
    samples.lower[d] = a;
    samples.upper[d] = b;
    crossing |= (crosses(a, b, facing) ? 1u : 0u) << d;
  });
  crossing &= directionsOnEdge(axis, facing);
  const float offset = edgeOffset(rules, samples, crossing, axis, facing);
  const Vec3f on_edge = vertexPosition(edge, offset);
  if (!directional) return on_edge;
  const auto anchors = [&](int end, int d) { return voxel(end, d).anchor; };
  return on_edge + anchoringShift(rules, samples, crossing, anchors, axis, facing, offset);
}

}  // namespace dtsdf
