/// A vertex on an edge of a block, from the device's map. For .cu files.
#pragma once

#include "corner_arrays.cuh"
#include "kernels/meshing/anchoring.h"
#include "mesh_kernels.h"

namespace dtsdf {
namespace gpu {

/// Samples beyond an end of an edge, of which few are asked for: read then.
struct SamplesBeyond {
  const ArraysAround& arrays;
  Vec3i corner;
  bool directional;

  __device__ Sample operator[](int d) const { return arrays.sample(corner, directional ? d : 0); }
};

struct EdgeOnDevice {
  Sample lower[kDirectionCount], upper[kDirectionCount];
  SamplesBeyond below, above;
};

__device__ inline BlockVertex makeVertex(const MeshView& mesh, const ArraysAround& arrays,
                                         int edge) {
  const int lower = edgeCorner(edge), axis = edgeAxis(edge), facing = edgeFacing(edge);
  const bool directional = mesh.directional != 0;
  const Vec3i corner = cornerAt(lower), step = unitStep(axis);
  EdgeOnDevice samples{
      {}, {}, {arrays, corner - step, directional}, {arrays, corner + step + step, directional}};
#pragma unroll  // so that the samples are in registers, and read all at once
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!directional && d != facedDirection(axis, facing)) continue;
    samples.lower[d] = arrays.sample(lower, directional ? d : 0);
    samples.upper[d] = arrays.sample(lower + cornerStride(axis), directional ? d : 0);
  }
  const uint32_t crossing = crossingDirections(samples, axis, facing);
  const float offset = edgeOffset(mesh.rules, samples, crossing, axis, facing);
  const Vec3f position = vertexPosition(edge, offset);
  if (!directional) return {position, static_cast<uint32_t>(edge)};
  const auto anchors = [&](int end, int d) {
    return arrays.voxel(end == 0 ? corner : corner + step, d).anchor;
  };
  return {position + anchoringShift(mesh.rules, samples, crossing, anchors, axis, facing, offset),
          static_cast<uint32_t>(edge)};
}

}  // namespace gpu
}  // namespace dtsdf
