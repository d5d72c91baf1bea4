// The index stage on the device: which blocks to mesh again, and the indices of their units.
#include "corner_arrays.cuh"
#include "kernels/meshing/sheets.h"
#include "launch.h"
#include "mesh_kernels.h"
#include "select_blocks.cuh"

namespace dtsdf {
namespace gpu {
namespace {

/// One thread per dirty block and reach, in strides: their number is known on the device only.
__global__ void reachBlocksKernel(MapView map, MeshView mesh) {
  const size_t count = static_cast<size_t>(*map.dirty_count) * kUnitReach;
  for (size_t i = globalThread(); i < count; i += static_cast<size_t>(gridDim.x) * blockDim.x) {
    const int32_t dirty = map.dirty_slots[i / kUnitReach];
    const int n = static_cast<int>(i % kUnitReach);
    if (n == 0) map.dirty[dirty] = 0;
    if (map.slots[dirty].key == kNoKey) continue;  // released before anybody asked for a mesh
    const int32_t slot = findSlot(map, packKey(keyOfSlot(map, dirty) + unitReachOffset(n)));
    if (slot < 0 || !select(map, mesh, slot)) continue;
    mesh.slots[atomicAdd(&mesh.counters->reached, 1u)] = slot;
  }
}

/// One thread per dirty block and block around it, in strides: meshes depend on voxels there. From
/// the end of the grid on, whose threads have the least to index.
__device__ void selectAround(const MapView& map, const MeshView& mesh) {
  const size_t count = static_cast<size_t>(*map.dirty_count) * kBlocksAround;
  const size_t threads = static_cast<size_t>(gridDim.x) * blockDim.x;
  for (size_t i = threads - 1 - globalThread(); i < count; i += threads) {
    const int32_t dirty = map.dirty_slots[i / kBlocksAround];
    const Vec3i offset = aroundOffset(static_cast<int>(i % kBlocksAround));
    if (map.slots[dirty].key == kNoKey) continue;
    selectAdjoining(map, mesh, keyOfSlot(map, dirty) + offset);
  }
}

/// The samples at a block's corner grid, in shared memory, direction by direction.
struct SharedCorners {
  Sample* samples;
  uint32_t present;

  __device__ void collect(const CornerArrays& arrays) {
    for (int i = threadIdx.x; i < kGridCorners; i += blockDim.x) {
      Sample sample[kDirectionCount];
#pragma unroll  // reads all before it waits for any
      for (int d = 0; d < kDirectionCount; ++d) {
        if (present >> d & 1) sample[d] = arrays.sample(i, d);
      }
#pragma unroll
      for (int d = 0; d < kDirectionCount; ++d) {
        if (present >> d & 1) samples[d * kGridCorners + i] = sample[d];
      }
    }
  }

  __device__ UnitSamples unit(const Vec3i& unit) const {
    UnitSamples result = {};
    for (int d = 0; d < kDirectionCount; ++d) {
      if (!(present >> d & 1)) continue;
      for (int c = 0; c < kCubeCorners; ++c) {
        result.corner[d][c] = samples[d * kGridCorners +
                                      cornerIndex(unit.x + (c & 1), unit.y + (c >> 1 & 1),
                                                   unit.z + (c >> 2 & 1))];
      }
    }
    return result;
  }
};

/// Labels this thread's units of a block.
__device__ void updateLabels(const MeshView& mesh, const SharedCorners& corners,
                             UnitLabels* stored) {
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) {
    const UnitSamples samples = corners.unit(voxelOffset(i));
    stored[i] = labelUnit(*mesh.tables, mesh.rules, samples, mesh.directional != 0);
  }
}

/// One block of threads per reached block, in strides; selects the others to be meshed before. Two
/// at a time on a multiprocessor, at the
/// price of a few registers: each waits for memory most of the time.
__global__ void __launch_bounds__(kThreads, 2) indexBlocksKernel(MapView map, MeshView mesh) {
  extern __shared__ Sample samples[];
  __shared__ CornerArrays arrays;
  __shared__ uint32_t present;
  selectAround(map, mesh);
  const uint32_t reached = mesh.counters->reached;
  for (uint32_t b = blockIdx.x; b < reached; b += gridDim.x) {
    const int32_t slot = mesh.slots[b];
    const BlockKey key = keyOfSlot(map, slot);
    if (threadIdx.x == 0) {
      present = 0;
      arrays.least_evidence = mesh.least_evidence;
    }
    __syncthreads();
    if (threadIdx.x < kCornerBlocks) {
      atomicOr(&present, findCornerArrays(map, key, threadIdx.x, arrays));
    }
    __syncthreads();
    SharedCorners corners{samples, present};
    corners.collect(arrays);
    __syncthreads();
    updateLabels(mesh, corners, map.unit_labels.record(slot));
    __syncthreads();  // of the samples, which the next block's overwrite
  }
}

size_t cornerGridBytes(bool directional) {
  return (directional ? kDirectionCount : 1) * kGridCorners * sizeof(Sample);
}

}  // namespace

void reachBlocks(const MapView& map, const MeshView& mesh, int thread_blocks,
                 const Stream& stream) {
  reachBlocksKernel<<<thread_blocks, kThreads, 0, stream.get()>>>(map, mesh);
  DTSDF_CHECK_LAUNCH("reachBlocksKernel");
}

void indexBlocks(const MapView& map, const MeshView& mesh, int thread_blocks,
                 const Stream& stream) {
  const size_t shared_bytes = cornerGridBytes(mesh.directional != 0);
  indexBlocksKernel<<<thread_blocks, kThreads, shared_bytes, stream.get()>>>(map, mesh);
  DTSDF_CHECK_LAUNCH("indexBlocksKernel");
}

std::vector<NamedKernel> indexKernels(bool directional) {
  return {DTSDF_NAMED_KERNEL(reachBlocksKernel, 0),
          DTSDF_NAMED_KERNEL(indexBlocksKernel, cornerGridBytes(directional))};
}

}  // namespace gpu
}  // namespace dtsdf
