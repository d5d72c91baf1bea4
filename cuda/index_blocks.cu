// The stage "index" on the device: selects the blocks to be meshed again, and finds the marching
// cubes cases (labels) of their units, the cubes between eight voxels.
#include "corner_arrays.cuh"
#include "kernels/meshing/possible_leaders.h"
#include "kernels/meshing/sheets.h"
#include "launch.h"
#include "mesh_kernels.h"

namespace dtsdf {
namespace gpu {
namespace {

__device__ const MeshTables kTables = kMeshTables;

/// One thread per pair of a dirty block and a block whose units have corners in the dirty one, in a
/// grid-stride loop, since the host does not know the number of pairs.
__global__ void reachBlocksKernel(MapView map, MeshView mesh) {
  const size_t count = static_cast<size_t>(*map.dirty.count) * kUnitReach;
  for (size_t i = globalThread(); i < count; i += static_cast<size_t>(gridDim.x) * blockDim.x) {
    const int32_t dirty = map.dirty.slots[i / kUnitReach];
    const int n = static_cast<int>(i % kUnitReach);
    if (n == 0) map.dirty.flags[dirty] = 0;
    if (map.slots[dirty].key == kNoKey) continue;  // released before this extraction
    const int32_t slot = findSlot(map, packKey(keyOfSlot(map, dirty) + unitReachOffset(n)));
    if (slot < 0 || !select(map, mesh, slot)) continue;
    mesh.slots[atomicAdd(&mesh.totals->reached, 1u)] = slot;
  }
}

/// Selects the neighbours of dirty blocks, as dirty blocks affect the meshes around them. One
/// thread per pair of a dirty block and a neighbour, in a grid-stride loop that starts with the
/// last thread, as the last thread blocks have the fewest blocks to index.
__device__ void selectAround(const MapView& map, const MeshView& mesh) {
  const size_t count = static_cast<size_t>(*map.dirty.count) * kBlocksAround;
  const size_t threads = static_cast<size_t>(gridDim.x) * blockDim.x;
  for (size_t i = threads - 1 - globalThread(); i < count; i += threads) {
    const int32_t dirty = map.dirty.slots[i / kBlocksAround];
    const Vec3i offset = aroundOffset(static_cast<int>(i % kBlocksAround));
    if (map.slots[dirty].key == kNoKey) continue;
    selectAdjoining(map, mesh, keyOfSlot(map, dirty) + offset);
  }
}

/// The corners of a block's units, and the candidates: the few units that can contain a surface.
struct BlockCorners {
  CornerArrays arrays;
  uint32_t present;              ///< Bit d: a block with these corners has an array of direction d.
  uint32_t sides[kGridCorners];  ///< sidesOfCorner()
  uint32_t count;
  uint16_t candidates[kVoxelsPerBlock];
};

/// The samples of a unit, read on demand from shared memory, which holds one grid per direction.
struct UnitOfGrid {
  using Real = float;
  using Bits = int32_t;
  static constexpr int kUnits = 1;
  const Sample* first;  ///< Sample of direction 0 at corner 0 of the unit.
  uint32_t sides;

  __device__ __forceinline__ const Sample& at(int d, int c) const {
    return first[d * kGridCorners + cornerIndex(c & 1, c >> 1 & 1, c >> 2 & 1)];
  }
  __device__ __forceinline__ float sdf(int d, int c) const { return at(d, c).sdf; }
  __device__ __forceinline__ float weight(int d, int c) const { return at(d, c).weight; }
  __device__ __forceinline__ bool isObserved(int d) const {
    return (observedDirections(sides) >> d & 1) != 0;
  }
  __device__ __forceinline__ bool mayBeActive(int d) const {
    return (possiblyActive(sides) >> d & 1) != 0;
  }
};

__device__ __forceinline__ int firstCornerOf(int unit) {
  const Vec3i at = voxelOffset(unit);
  return cornerIndex(at.x, at.y, at.z);
}

__device__ __forceinline__ uint32_t sidesOfUnit(const BlockCorners& block, int unit) {
  const uint32_t* first = block.sides + firstCornerOf(unit);
  uint32_t sides = 0;
#pragma unroll
  for (int c = 0; c < kCubeCorners; ++c) {
    sides |= first[cornerIndex(c & 1, c >> 1 & 1, c >> 2 & 1)];
  }
  return sides;
}

__device__ void collectCorners(BlockCorners& block, Sample* samples) {
  const uint32_t present = block.present;
  for (int i = threadIdx.x; i < kGridCorners; i += blockDim.x) {
    Sample sample[kDirectionCount];
#pragma unroll  // all reads are issued before the first is needed
    for (int d = 0; d < kDirectionCount; ++d) {
      if (present >> d & 1) sample[d] = block.arrays.sample(i, d);
    }
    uint32_t sides = 0;
#pragma unroll
    for (int d = 0; d < kDirectionCount; ++d) {
      if (!(present >> d & 1)) continue;
      samples[d * kGridCorners + i] = sample[d];
      sides |= sidesOfSample(d, sample[d].sdf, sample[d].weight);
    }
    block.sides[i] = sidesOfCorner(sides);
  }
}

/// Lists the units that can contain a surface, and labels all other units as empty.
__device__ void listCandidates(BlockCorners& block, UnitLabels* stored) {
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) {
    const bool is_candidate = possibleLeaders(sidesOfUnit(block, i)) != 0;
    if (!is_candidate) stored[i] = UnitLabels{0, 0};
    const uint32_t candidates = __ballot_sync(~0u, is_candidate);
    const uint32_t lane = threadIdx.x % 32;
    uint32_t first = 0;
    if (lane == 0 && candidates != 0) first = atomicAdd(&block.count, __popc(candidates));
    first = __shfl_sync(~0u, first, 0);
    if (is_candidate) {
      block.candidates[first + __popc(candidates & ((1u << lane) - 1u))] = static_cast<uint16_t>(i);
    }
  }
}

__device__ void labelCandidates(const MeshView& mesh, const BlockCorners& block,
                                const Sample* samples, UnitLabels* stored) {
  for (uint32_t k = threadIdx.x; k < block.count; k += blockDim.x) {
    const int unit = block.candidates[k];
    const UnitOfGrid grid{samples + firstCornerOf(unit), sidesOfUnit(block, unit)};
    UnitLabels labels[1];
    labelUnits(kTables, mesh.rules, grid, mesh.directional != 0, labels);
    stored[unit] = labels[0];
  }
}

/// One thread block per block selected by reachBlocks(), in a grid-stride loop. First selects the
/// neighbours that must be meshed too. Several thread blocks share a multiprocessor, as they spend
/// most of their time waiting for memory.
__global__ void __launch_bounds__(kThreads, 4) indexBlocksKernel(MapView map, MeshView mesh) {
  waitForPreviousKernel();
  extern __shared__ Sample samples[];
  __shared__ BlockCorners block;
  selectAround(map, mesh);
  const uint32_t reached = mesh.totals->reached;
  for (uint32_t b = blockIdx.x; b < reached; b += gridDim.x) {
    const int32_t slot = mesh.slots[b];
    const BlockKey key = keyOfSlot(map, slot);
    if (threadIdx.x == 0) {
      block.present = block.count = 0;
      block.arrays.min_evidence = mesh.min_evidence;
    }
    __syncthreads();
    if (threadIdx.x < kCornerBlocks) {
      const int n = static_cast<int>(threadIdx.x);
      const int32_t beside = findSlot(map, packKey(key + cornerBlockOffset(n)));
      atomicOr(&block.present, findArrays(map, beside, block.arrays.array[n]));
    }
    __syncthreads();
    collectCorners(block, samples);
    __syncthreads();
    UnitLabels* stored = map.unit_labels.record(slot);
    listCandidates(block, stored);
    __syncthreads();
    labelCandidates(mesh, block, samples, stored);
    __syncthreads();  // the next block overwrites the samples
  }
}

size_t cornerGridBytes(bool directional) {
  return (directional ? kDirectionCount : 1) * kGridCorners * sizeof(Sample);
}

}  // namespace

void reachBlocks(const MapView& map, const MeshView& mesh, int thread_blocks,
                 const Stream& stream) {
  launch("reachBlocksKernel", reachBlocksKernel, thread_blocks, kThreads, 0, stream, map, mesh);
}

void indexBlocks(const MapView& map, const MeshView& mesh, int thread_blocks,
                 const Stream& stream) {
  const size_t shared_bytes = cornerGridBytes(mesh.directional != 0);
  launchOverlapped("indexBlocksKernel", indexBlocksKernel, thread_blocks, kThreads, shared_bytes,
                   stream, map, mesh);
}

}  // namespace gpu
}  // namespace dtsdf
