// Colours the vertices of extracted meshes on the device.
#include "corner_arrays.cuh"
#include "kernels/colour/vertex_colour.h"
#include "launch.h"
#include "mesh_kernels.h"

namespace dtsdf {
namespace gpu {
namespace {

/// For each painted block, marks the blocks whose mesh units have corners in it. One thread per
/// pair of blocks, in a grid-stride loop.
__global__ void selectPaintedKernel(MapView map, MeshView mesh) {
  waitForPreviousKernel();
  const size_t count = static_cast<size_t>(*map.painted.count) * kUnitReach;
  for (size_t i = globalThread(); i < count; i += static_cast<size_t>(gridDim.x) * blockDim.x) {
    const int32_t painted = map.painted.slots[i / kUnitReach];
    const int n = static_cast<int>(i % kUnitReach);
    if (n == 0) map.painted.flags[painted] = 0;
    if (map.slots[painted].key == kNoKey) continue;
    selectAdjoining(map, mesh, keyOfSlot(map, painted) + unitReachOffset(n));
  }
}

/// Empties the list of painted blocks. Launched with a single thread.
__global__ void forgetPaintedKernel(MapView map) {
  waitForPreviousKernel();
  *map.painted.count = 0;
}

/// Shared memory for colouring the vertices of a block.
struct ColourShared {
  ColouredCorners corners;
  int32_t slots[kCornerBlocks];  ///< Slots of the blocks in which the corners lie.
  uint16_t vertex_of[kGridEdges];
};

/// Finds the voxels and colours at the corners of units. All threads of the thread block must call
/// it.
__device__ void findColours(const MapView& map, const BlockKey& key, ColourShared& shared) {
  ColouredCorners& corners = shared.corners;
  const auto t = static_cast<int>(threadIdx.x);
  if (t < kCornerBlocks) {
    shared.slots[t] = findSlot(map, packKey(key + cornerBlockOffset(t)));
    findArrays(map, shared.slots[t], corners.voxels.array[t]);
    corners.clearBlock(t);
  }
  __syncthreads();
  static_assert(kCornerBlocks * kBricksPerArray <= kThreads, "each brick needs a thread");
  const int n = t / kBricksPerArray, brick = t % kBricksPerArray;
  if (n < kCornerBlocks) {
    for (int d = 0; d < kDirectionCount; ++d) {
      const int32_t array = shared.slots[n] < 0 ? kNoArray : map.slots[shared.slots[n]].array[d];
      corners.setBrick(n, d, brick, array == kNoArray ? nullptr : coloursOf(map, array, brick));
    }
  }
  __syncthreads();
}

/// Finds which corners are painted. All threads of the thread block must call it.
__device__ void findPainted(ColouredCorners& corners) {
  for (int i = threadIdx.x; i < kPaintedRows; i += kThreads) findPaintedRow(corners, i);
  __syncthreads();
}

/// Colours the vertices on edges, one per thread at a time. All threads of the thread block must
/// call it.
__device__ void colourEdges(const MeshView& mesh, const MeshRecord& record, ColourShared& shared) {
  const bool directional = mesh.directional != 0;
  const BlockVertex* vertices = mesh.vertices + record.first_vertex;
  bool knows_painted = false;
  for (uint32_t first = 0; first < record.vertices; first += kThreads) {
    const uint32_t i = first + threadIdx.x;
    const uint32_t number = i < record.vertices ? vertices[i].edge : midpointNumber(0, 0);
    const auto edge = static_cast<int>(number);
    VertexColour colour{0, 0, 0, 255};
    if (!isMidpoint(number)) {
      shared.vertex_of[edge] = static_cast<uint16_t>(i);
      colour = colourOnEdge(shared.corners, edge, directional);
    }
    if (__syncthreads_or(colour.painted == 0)) {  // a rare case
      if (!knows_painted) findPainted(shared.corners);
      knows_painted = true;
      if (colour.painted == 0) colour = colourNearEdge(shared.corners, edge, directional);
    }
    if (!isMidpoint(number)) mesh.colours[record.first_vertex + i] = colour;
  }
  __syncthreads();
}

/// Colours the vertices at midpoints of sides. @pre The vertices at the ends of these sides are
/// coloured.
__device__ void colourMidpoints(const MeshView& mesh, const MeshRecord& record,
                                const ColourShared& shared) {
  const BlockVertex* vertices = mesh.vertices + record.first_vertex;
  VertexColour* colours = mesh.colours + record.first_vertex;
  for (uint32_t i = threadIdx.x; i < record.vertices; i += kThreads) {
    const uint32_t number = vertices[i].edge;
    if (!isMidpoint(number)) continue;
    colours[i] = meanColour(colours[shared.vertex_of[midpointFirstEnd(number)]],
                            colours[shared.vertex_of[midpointSecondEnd(number)]]);
  }
}

/// One thread block per meshed block, in a grid-stride loop. Skips blocks whose meshes did not fit
/// into the buffers.
__global__ void __launch_bounds__(kThreads) colourVerticesKernel(MapView map, MeshView mesh) {
  waitForPreviousKernel();
  __shared__ ColourShared shared;
  if (threadIdx.x == 0) shared.corners.voxels.min_evidence = mesh.min_evidence;
  const uint32_t count = mesh.totals->reached + mesh.totals->adjoining;
  for (uint32_t b = blockIdx.x; b < count; b += gridDim.x) {
    const MeshRecord record = mesh.records[b];
    if (record.vertices == 0 || record.first_vertex + record.vertices > mesh.capacity.vertices ||
        record.first_triangle + record.triangles > mesh.capacity.triangles) {
      continue;  // all threads of the block, or none
    }
    findColours(map, unpackKey(record.key), shared);
    colourEdges(mesh, record, shared);
    if (mesh.refined) colourMidpoints(mesh, record, shared);
  }
}

}  // namespace

void selectPainted(const MapView& map, const MeshView& mesh, int thread_blocks,
                   const Stream& stream) {
  launchOverlapped("selectPaintedKernel", selectPaintedKernel, thread_blocks, kThreads, 0, stream,
                   map, mesh);
  launchOverlapped("forgetPaintedKernel", forgetPaintedKernel, 1, 1, 0, stream, map);
}

void colourVertices(const MapView& map, const MeshView& mesh, int thread_blocks,
                    const Stream& stream) {
  launchOverlapped("colourVerticesKernel", colourVerticesKernel, thread_blocks, kThreads, 0, stream,
                   map, mesh);
}

}  // namespace gpu
}  // namespace dtsdf
