#include "paint_kernels.h"

#include "device_map.cuh"
#include "launch.h"
#include "named_kernels.h"

namespace dtsdf {
namespace gpu {
namespace {

/// One thread per pixel of a level.
__global__ void halveImageKernel(ColourImage image, ColourPixel* pixels, int level) {
  const ColourLevel& to = image.level[level];
  const size_t count = static_cast<size_t>(to.width) * to.height;
  for (size_t i = globalThread(); i < count; i += static_cast<size_t>(gridDim.x) * blockDim.x) {
    pixels[to.first + i] = halvedPixel(image, level, static_cast<int32_t>(i % to.width),
                                       static_cast<int32_t>(i / to.width));
  }
}

/// One thread per cell.
__global__ void clearHidingKernel(float* depth_m, size_t cells) {
  const size_t i = globalThread();
  if (i < cells) depth_m[i] = kNoSurface_m;
}

/// One thread per slot: lists the blocks in view.
__global__ void findBlocksInViewKernel(PointView view, MapView map, LookView look) {
  const size_t slot = globalThread();
  if (slot >= map.slot_count || map.slots[slot].key == kNoKey) return;
  const BlockKey key = unpackKey(map.slots[slot].key);
  const BlockKey origin = blockOfVoxel(view.frame.origin_voxel);
  if (!mayBeInView(view.frame, key - origin, pointRadius(view.rules))) return;
  look.slots[atomicAdd(&look.counters->blocks, 1u)] = static_cast<int32_t>(slot);
}

__device__ Vec3f firstVoxelOf(const FrameView& frame, const SlotEntry& entry) {
  return toFloat(
      firstVoxelOfBlock(unpackKey(entry.key) - blockOfVoxel(frame.origin_voxel)));
}

/// Calls visit(direction, array, voxels, index) for the voxels of a block on this thread's turn.
template <class Visit>
__device__ void visitVoxels(const MapView& map, const SlotEntry& entry, const Visit& visit) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    const Voxel* voxels = map.voxels.record(entry.array[d]);
    for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) {
      visit(d, entry.array[d], voxels, i);
    }
  }
}

/// Depths are above 0, so that they sort as their bits do.
__device__ void lowerTo(float* depth_m, float value) {
  atomicMin(reinterpret_cast<int*>(depth_m), __float_as_int(value));
}

/// One block of threads per block in view, in strides.
__global__ void drawHidingKernel(PointView view, MapView map, LookView look, float* depth_m) {
  const uint32_t count = look.counters->blocks;
  for (uint32_t b = blockIdx.x; b < count; b += gridDim.x) {
    const SlotEntry& entry = map.slots[look.slots[b]];
    const Vec3f first_voxel_L = firstVoxelOf(view.frame, entry);
    visitVoxels(map, entry, [&](int direction, int32_t, const Voxel* voxels, int i) {
      SurfacePoint point;
      if (!hides(view, voxels, i, direction)) return;
      if (!findSurfacePoint(view, first_voxel_L, voxels, i, direction, point)) return;
      drawSurface(view, point, [&](int32_t cell, float cell_m) {
        lowerTo(depth_m + cell, cell_m);
      });
    });
  }
}

__device__ void addAtomically(int64_t* sum, int64_t value) {
  atomicAdd(reinterpret_cast<unsigned long long*>(sum), static_cast<unsigned long long>(value));
}

/// What a block of threads finds in one block of the map.
struct BlockLook {
  ExposureSums sums;
  unsigned long long lacking;  ///< Bits of the bricks that are to be painted and are not there.
  uint32_t samples;
};

__device__ void addAtomically(ExposureSums& sums, const ExposureSums& part) {
  if (part.voxels == 0) return;
  for (int i = 0; i < 3; ++i) {
    addAtomically(&sums.map[i], part.map[i]);
    addAtomically(&sums.image[i], part.image[i]);
  }
  addAtomically(&sums.voxels, part.voxels);
}

/// Adds what was found in a block to the image's counters, by one thread.
__device__ void report(const LookView& look, PackedKey key, const BlockLook& found) {
  if (found.samples == 0) return;
  LookCounters& counters = *look.counters;
  atomicAdd(&counters.seen, 1u);
  atomicAdd(reinterpret_cast<unsigned long long*>(&counters.samples),
            static_cast<unsigned long long>(found.samples));
  addAtomically(counters.sums, found.sums);
  if (found.lacking == 0) return;
  look.requests[atomicAdd(&counters.requests, 1u)] = {key, found.lacking};
}

/// One block of threads per block in view, in strides.
__global__ void lookKernel(ColourSensing sensing, MapView map, LookView look) {
  __shared__ BlockLook found;
  const uint32_t count = look.counters->blocks;
  for (uint32_t b = blockIdx.x; b < count; b += gridDim.x) {
    const SlotEntry& entry = map.slots[look.slots[b]];
    if (threadIdx.x == 0) found = {};
    __syncthreads();
    const Vec3f first_voxel_L = firstVoxelOf(sensing.view.frame, entry);
    ExposureSums sums = {};
    visitVoxels(map, entry, [&](int direction, int32_t array, const Voxel* voxels, int i) {
      const ColourSample sample = sampleColour(sensing, first_voxel_L, voxels, i, direction);
      if (!(sample.weight > 0.0f)) return;
      const VoxelColour* colour = colourOf(map, array, i);
      atomicAdd(&found.samples, 1u);
      if (colour == nullptr) {
        atomicOr(&found.lacking, static_cast<unsigned long long>(brickBit(direction, i)));
        return;
      }
      const VoxelColour seen{sample.red, sample.green, sample.blue, 0};
      if (tellsExposure(*colour, seen, sample.weight, sensing.view.rules)) {
        addToSums(sums, *colour, seen);
      }
    });
    addAtomically(found.sums, sums);
    __syncthreads();
    if (threadIdx.x == 0) report(look, entry.key, found);
    __syncthreads();
  }
}

/// The same once more, now that there are bricks.
__global__ void paintKernel(ColourSensing sensing, Exposure exposure, MapView map, LookView look) {
  const uint32_t count = look.counters->blocks;
  for (uint32_t b = blockIdx.x; b < count; b += gridDim.x) {
    const int32_t slot = look.slots[b];
    const SlotEntry& entry = map.slots[slot];
    const Vec3f first_voxel_L = firstVoxelOf(sensing.view.frame, entry);
    int changed = 0;
    visitVoxels(map, entry, [&](int direction, int32_t array, const Voxel* voxels, int i) {
      VoxelColour* colour = colourOf(map, array, i);
      if (colour == nullptr) return;
      const ColourSample sample = sampleColour(sensing, first_voxel_L, voxels, i, direction);
      if (!(sample.weight > 0.0f)) return;
      const VoxelColour painted = paintedColour(*colour, sample, exposure, sensing.view.rules);
      changed |= looksDifferent(*colour, painted);
      *colour = painted;
    });
    if (__syncthreads_or(changed) && threadIdx.x == 0) markPainted(map, slot);
  }
}

}  // namespace

void halveImage(const ColourImage& image, ColourPixel* pixels, const Stream& stream) {
  for (int level = 1; level < kColourLevels; ++level) {
    const size_t count = static_cast<size_t>(image.level[level].width) * image.level[level].height;
    halveImageKernel<<<blocksFor(count), kThreads, 0, stream.get()>>>(image, pixels, level);
    DTSDF_CHECK_LAUNCH("halveImageKernel");
  }
}

void findBlocksInView(const PointView& view, const MapView& map, const LookView& look,
                      const Stream& stream) {
  if (map.slot_count == 0) return;
  findBlocksInViewKernel<<<blocksFor(map.slot_count), kThreads, 0, stream.get()>>>(view, map,
                                                                                    look);
  DTSDF_CHECK_LAUNCH("findBlocksInViewKernel");
}

void drawHiding(const ColourSensing& sensing, const MapView& map, const LookView& look,
                float* depth_m, const Stream& stream) {
  const size_t cells = static_cast<size_t>(sensing.hiding.width) * sensing.hiding.height;
  clearHidingKernel<<<blocksFor(cells), kThreads, 0, stream.get()>>>(depth_m, cells);
  DTSDF_CHECK_LAUNCH("clearHidingKernel");
  drawHidingKernel<<<look.thread_blocks, kThreads, 0, stream.get()>>>(sensing.view, map, look,
                                                                      depth_m);
  DTSDF_CHECK_LAUNCH("drawHidingKernel");
}

void lookAtSurfaces(const ColourSensing& sensing, const MapView& map, const LookView& look,
                    const Stream& stream) {
  lookKernel<<<look.thread_blocks, kThreads, 0, stream.get()>>>(sensing, map, look);
  DTSDF_CHECK_LAUNCH("lookKernel");
}

void paintSurfaces(const ColourSensing& sensing, const Exposure& exposure, const MapView& map,
                   const LookView& look, const Stream& stream) {
  paintKernel<<<look.thread_blocks, kThreads, 0, stream.get()>>>(sensing, exposure, map, look);
  DTSDF_CHECK_LAUNCH("paintKernel");
}

std::vector<NamedKernel> paintKernels() {
  return {DTSDF_NAMED_KERNEL(halveImageKernel, 0), DTSDF_NAMED_KERNEL(clearHidingKernel, 0),
          DTSDF_NAMED_KERNEL(findBlocksInViewKernel, 0), DTSDF_NAMED_KERNEL(drawHidingKernel, 0),
          DTSDF_NAMED_KERNEL(lookKernel, 0), DTSDF_NAMED_KERNEL(paintKernel, 0)};
}

}  // namespace gpu
}  // namespace dtsdf
