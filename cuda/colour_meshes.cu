// Colours of vertices on the device, once the make stage has made them.
#include "corner_arrays.cuh"
#include "kernels/colour/vertex_colour.h"
#include "launch.h"
#include "mesh_kernels.h"
#include "select_blocks.cuh"

namespace dtsdf {
namespace gpu {
namespace {

/// One thread per painted block and reach, in strides.
__global__ void selectPaintedKernel(MapView map, MeshView mesh) {
  const size_t count = static_cast<size_t>(*map.painted.count) * kUnitReach;
  for (size_t i = globalThread(); i < count; i += static_cast<size_t>(gridDim.x) * blockDim.x) {
    const int32_t painted = map.painted.slots[i / kUnitReach];
    const int n = static_cast<int>(i % kUnitReach);
    if (n == 0) map.painted.flags[painted] = 0;
    if (map.slots[painted].key == kNoKey) continue;
    selectAdjoining(map, mesh, keyOfSlot(map, painted) + unitReachOffset(n));
  }
}

/// One thread: the list is done with.
__global__ void forgetPaintedKernel(MapView map) { *map.painted.count = 0; }

/// Done by one thread for each of the blocks that the corners of a block's units lie in.
__device__ void findColours(const MapView& map, const BlockKey& key, int n,
                            ColouredCorners& corners) {
  findCornerArrays(map, key, n, corners.voxels);
  corners.clearBlock(n);
  const int32_t slot = findSlot(map, packKey(key + cornerBlockOffset(n)));
  for (int d = 0; d < kDirectionCount; ++d) {
    const int32_t array = slot < 0 ? kNoArray : map.slots[slot].array[d];
    for (int brick = 0; brick < kBricksPerArray; ++brick) {
      corners.setBrick(n, d, brick, array == kNoArray ? nullptr : coloursOf(map, array, brick));
    }
  }
}

/// One block of threads per block that was meshed, in strides. Vertices that found no room have no
/// colours either.
__global__ void colourVerticesKernel(MapView map, MeshView mesh) {
  __shared__ ColouredCorners corners;
  const uint32_t count = mesh.counters->reached + mesh.counters->adjoining;
  for (uint32_t b = blockIdx.x; b < count; b += gridDim.x) {
    const MeshRecord record = mesh.records[b];
    if (record.vertices == 0 || record.first_vertex + record.vertices > mesh.capacity.vertices ||
        record.first_triangle + record.triangles > mesh.capacity.triangles) {
      continue;  // the same for all threads of the block
    }
    __syncthreads();  // of the block before
    if (threadIdx.x == 0) corners.voxels.least_evidence = mesh.least_evidence;
    if (threadIdx.x < kCornerBlocks) {
      findColours(map, unpackKey(record.key), threadIdx.x, corners);
    }
    __syncthreads();
    for (uint32_t i = threadIdx.x; i < record.vertices; i += blockDim.x) {
      const uint32_t at = record.first_vertex + i;
      mesh.colours[at] = vertexColourOf(corners, mesh.vertices[at].edge, mesh.directional != 0);
    }
  }
}

}  // namespace

void selectPainted(const MapView& map, const MeshView& mesh, int thread_blocks,
                   const Stream& stream) {
  selectPaintedKernel<<<thread_blocks, kThreads, 0, stream.get()>>>(map, mesh);
  DTSDF_CHECK_LAUNCH("selectPaintedKernel");
  forgetPaintedKernel<<<1, 1, 0, stream.get()>>>(map);
  DTSDF_CHECK_LAUNCH("forgetPaintedKernel");
}

void colourVertices(const MapView& map, const MeshView& mesh, int thread_blocks,
                    const Stream& stream) {
  colourVerticesKernel<<<thread_blocks, kThreads, 0, stream.get()>>>(map, mesh);
  DTSDF_CHECK_LAUNCH("colourVerticesKernel");
}

std::vector<NamedKernel> colourKernels() {
  return {DTSDF_NAMED_KERNEL(selectPaintedKernel, 0), DTSDF_NAMED_KERNEL(forgetPaintedKernel, 0, 1),
          DTSDF_NAMED_KERNEL(colourVerticesKernel, 0)};
}

}  // namespace gpu
}  // namespace dtsdf
