/// A vertex on an edge of a block, from the device's map. For .cu files.
#pragma once

#include "corner_arrays.cuh"
#include "kernels/meshing/make_vertex.h"
#include "mesh_kernels.h"

namespace dtsdf {
namespace gpu {

__device__ inline BlockVertex makeVertex(const MeshView& mesh, const ArraysAround& arrays,
                                         int edge) {
  const int lower = edgeCorner(edge), axis = edgeAxis(edge), facing = edgeFacing(edge);
  const bool directional = mesh.directional != 0;
  const Vec3i corner = cornerAt(lower);
  EdgeSamples samples(arrays, corner, axis, directional);
#pragma unroll  // so that the samples are in registers, and read all at once
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!directional && d != facedDirection(axis, facing)) continue;
    samples.lower[d] = arrays.sample(lower, directional ? d : 0);
    samples.upper[d] = arrays.sample(lower + cornerStride(axis), directional ? d : 0);
  }
  const uint32_t crossing = crossingDirections(samples, axis, facing);
  const auto anchors = [&](int end, int d) {
    return arrays.voxel(end == 0 ? corner : corner + unitStep(axis), d).anchor;
  };
  return dtsdf::makeVertex(mesh.rules, samples, crossing, anchors, edge, directional);
}

}  // namespace gpu
}  // namespace dtsdf
