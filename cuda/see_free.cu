#include "see_free.h"

#include <algorithm>
#include <utility>

#include "launch.h"
#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

/// Levels that one launch makes, of patches that a block of threads has to itself; and its first
/// one has as many texels as there are threads.
constexpr int kPatchLevels = 5;
static_assert((1 << (kPatchLevels - 1)) * (1 << (kPatchLevels - 1)) == kThreads, "a texel each");

constexpr int kFinishingThreads = 1024;

/// The pyramid while it is made.
struct PyramidLevels {
  const float* free_depth;
  float* level[kFreeLevels];  ///< From the second one on.
  int32_t width, height;

  DTSDF_HD int32_t widthOf(int k) const { return texelsFor(width, k); }
  DTSDF_HD int32_t heightOf(int k) const { return texelsFor(height, k); }

#ifdef __CUDACC__
  /// Makes a texel, if there is one.
  __device__ __forceinline__ void make(int k, int32_t u, int32_t v) const {
    if (u >= widthOf(k) || v >= heightOf(k)) return;
    const float* const below = k == 1 ? free_depth : level[k - 1];
    level[k][static_cast<int64_t>(v) * widthOf(k) + u] =
        leastBelow(below, widthOf(k - 1), heightOf(k - 1), u, v);
  }
#endif
};

/// One block of threads per patch: what it makes of a level is all that its next level takes.
__global__ void makeFreePatchesKernel(PyramidLevels levels) {
  const int32_t patches_along = levels.widthOf(kPatchLevels);
  const int32_t patch_u = static_cast<int32_t>(blockIdx.x) % patches_along,
                patch_v = static_cast<int32_t>(blockIdx.x) / patches_along;
  for (int k = 1; k <= kPatchLevels; ++k) {
    const int side_log2 = kPatchLevels - k;
    if (threadIdx.x < 1u << (2 * side_log2)) {
      const int32_t x = static_cast<int32_t>(threadIdx.x) & ((1 << side_log2) - 1);
      const int32_t y = static_cast<int32_t>(threadIdx.x) >> side_log2;
      levels.make(k, (patch_u << side_log2) + x, (patch_v << side_log2) + y);
    }
    __syncthreads();
  }
}

/// What is left of the levels, with one block of threads.
__global__ void __launch_bounds__(kFinishingThreads) finishPyramidKernel(PyramidLevels levels) {
  for (int k = kPatchLevels + 1; k < kFreeLevels; ++k) {
    const int32_t width = levels.widthOf(k);
    const int64_t texels = static_cast<int64_t>(width) * levels.heightOf(k);
    for (int64_t i = threadIdx.x; i < texels; i += kFinishingThreads) {
      levels.make(k, static_cast<int32_t>(i % width), static_cast<int32_t>(i / width));
    }
    __syncthreads();
  }
}

/// One block of threads per cube.
__global__ void seeFreeKernel(FrameView frame, FreePyramid free, CellGrid grid, float max_range_m,
                              const Vec3i* cubes, CellMask* masks) {
  __shared__ VoxelInImage corners[kCornersPerCube];
  const CubeLook look = lookAt(frame, grid, cubes[blockIdx.x]);
  for (int i = threadIdx.x; i < kCornersPerCube; i += kThreads) {
    const int x = i % kCornersAlong, y = i / kCornersAlong % kCornersAlong,
              z = i / (kCornersAlong * kCornersAlong);
    corners[i] = cornerInImage(frame, look, x, y, z);
  }
  __syncthreads();
  const auto corner = [&](int x, int y, int z) { return corners[cubeCornerIndex(x, y, z)]; };
  CellMask& mask = masks[blockIdx.x];
  for (int cell = threadIdx.x; cell < kCellsPerCube; cell += kThreads) {
    const bool is_free = isCellSeenFree(free, corner, cell, max_range_m);
    const uint32_t free_cells = __ballot_sync(~0u, is_free);  // of 32 cells in a row
    if (cell % 32 == 0) reinterpret_cast<uint32_t*>(mask.word)[cell / 32] = free_cells;
  }
}
static_assert(kCellsPerCube % kThreads == 0, "no warp has idle threads");

/// Where a level begins among those from the second one on; of kFreeLevels, where the last ends.
size_t beginOf(int level, const FrameView& frame) {
  size_t begin = 0;
  for (int k = 1; k < level; ++k) {
    begin += static_cast<size_t>(texelsFor(frame.width, k)) * texelsFor(frame.height, k);
  }
  return begin;
}

}  // namespace

FreeCellFinder::FreeCellFinder(const CellGrid& grid, float max_range_m, const Stream& stream)
    : grid_(grid), max_range_m_(max_range_m), stream_(stream) {}

void FreeCellFinder::reserve(const FrameView& frame) {
  levels_.reserveExactly(beginOf(kFreeLevels, frame), stream_);
  cubes_.reserve(keys_.size(), stream_);
  masks_.reserve(keys_.size(), stream_);
  pinned_cubes_.reserve(keys_.size());
  pinned_masks_.reserve(keys_.size());
}

void FreeCellFinder::find(const FrameView& frame, const float* free_depth,
                          std::vector<Vec3i> cubes) {
  fetched_.wait();  // of a frame that did not become part of the map; else it is done
  keys_ = std::move(cubes);
  if (keys_.empty()) return;
  reserve(frame);
  std::copy(keys_.begin(), keys_.end(), pinned_cubes_.data());
  holdForProfile(stream_);
  const StageSpan span(stream_, Stage::kSeeFree);
  cubes_.upload(pinned_cubes_.data(), keys_.size(), stream_);
  const FreePyramid free = makePyramid(frame, free_depth);
  launch("seeFreeKernel", seeFreeKernel, static_cast<unsigned>(keys_.size()), kThreads, 0, stream_,
         frame, free, grid_, max_range_m_, cubes_.data(), masks_.data());
  masks_.download(pinned_masks_.data(), keys_.size(), stream_);
  stream_.record(fetched_);
}

FreePyramid FreeCellFinder::makePyramid(const FrameView& frame, const float* free_depth) {
  PyramidLevels levels{free_depth, {}, frame.width, frame.height};
  FreePyramid free{{free_depth}, frame.width, frame.height};
  for (int k = 1; k < kFreeLevels; ++k) {
    levels.level[k] = levels_.data() + beginOf(k, frame);
    free.level[k] = levels.level[k];
  }
  // In one row, since an image may be higher than a grid.
  const auto patches = static_cast<unsigned>(texelsFor(frame.width, kPatchLevels) *
                                             texelsFor(frame.height, kPatchLevels));
  launch("makeFreePatchesKernel", makeFreePatchesKernel, patches, kThreads, 0, stream_, levels);
  launch("finishPyramidKernel", finishPyramidKernel, 1, kFinishingThreads, 0, stream_, levels);
  return free;
}

std::vector<FreeCube> FreeCellFinder::take() {
  std::vector<FreeCube> seen;
  if (!keys_.empty()) fetched_.wait();
  for (size_t i = 0; i < keys_.size(); ++i) {
    if (!isEmpty(pinned_masks_[i])) seen.push_back({keys_[i], pinned_masks_[i]});
  }
  keys_.clear();
  return seen;
}

void FreeCellFinder::addMemory(std::vector<MemoryPart>& parts) const {
  addScratch("free cells", parts, levels_, cubes_, masks_, pinned_cubes_, pinned_masks_);
}

}  // namespace gpu
}  // namespace dtsdf
