#include "see_free.h"

#include <algorithm>
#include <utility>

#include "launch.h"

namespace dtsdf {
namespace gpu {
namespace {

/// One thread per texel of a pyramid level.
__global__ void makeFreeLevelKernel(const float* below, int32_t width_below, int32_t height_below,
                                    int32_t width, int32_t height, float* texels) {
  const auto i = static_cast<int64_t>(globalThread());
  if (i >= static_cast<int64_t>(width) * height) return;
  texels[i] = minBelow(below, width_below, height_below, static_cast<int32_t>(i % width),
                       static_cast<int32_t>(i / width));
}

/// One thread block per cube.
__global__ void seeFreeKernel(FrameView frame, FreePyramid free, int32_t cell_log2,
                              float max_range_m, const Vec3i* cubes, CellMask* masks) {
  __shared__ VoxelInImage corners[kCornersPerCube];
  const Vec3f first_L = cornerOfCube(frame, cell_log2, cubes[blockIdx.x]);
  for (int i = threadIdx.x; i < kCornersPerCube; i += kThreads) {
    corners[i] = cornerInImage(frame, first_L, cell_log2, i);
  }
  __syncthreads();
  CellMask& mask = masks[blockIdx.x];
  for (int cell = threadIdx.x; cell < kCellsPerCube; cell += kThreads) {
    const bool is_free = isCellSeenFree(free, corners, cell, max_range_m);
    const uint32_t free_cells = __ballot_sync(~0u, is_free);  // for 32 consecutive cells
    if (cell % 32 == 0) reinterpret_cast<uint32_t*>(mask.word)[cell / 32] = free_cells;
  }
}
static_assert(kCellsPerCube % kThreads == 0, "no warp may have idle threads");

/// Index of the first texel of a pyramid level in levels_, which starts with level 1. For `level`
/// kFreeLevels, the end of the last level.
size_t beginOf(int level, const FrameView& frame) {
  size_t begin = 0;
  for (int k = 1; k < level; ++k) {
    begin += static_cast<size_t>(texelsFor(frame.width, k)) * texelsFor(frame.height, k);
  }
  return begin;
}

}  // namespace

FreeCellFinder::FreeCellFinder(int32_t cell_log2, float max_range_m, const Stream& stream)
    : cell_log2_(cell_log2), max_range_m_(max_range_m), stream_(stream) {}

void FreeCellFinder::reserve(const FrameView& frame) {
  levels_.reserveExactly(beginOf(kFreeLevels, frame), stream_);
  cubes_.reserve(keys_.size(), stream_);
  masks_.reserve(keys_.size(), stream_);
  pinned_cubes_.reserve(keys_.size());
  pinned_masks_.reserve(keys_.size());
}

void FreeCellFinder::find(const FrameView& frame, const float* free_depth,
                          std::vector<Vec3i> cubes) {
  fetched_.wait();  // has an effect only if the last frame was not fused
  keys_ = std::move(cubes);
  if (keys_.empty()) return;
  reserve(frame);
  std::copy(keys_.begin(), keys_.end(), pinned_cubes_.data());
  cubes_.upload(pinned_cubes_.data(), keys_.size(), stream_);
  const FreePyramid free = makePyramid(frame, free_depth);
  launch("seeFreeKernel", seeFreeKernel, static_cast<unsigned>(keys_.size()), kThreads, 0, stream_,
         frame, free, cell_log2_, max_range_m_, cubes_.data(), masks_.data());
  masks_.download(pinned_masks_.data(), keys_.size(), stream_);
  stream_.record(fetched_);
}

FreePyramid FreeCellFinder::makePyramid(const FrameView& frame, const float* free_depth) {
  FreePyramid free{{free_depth}, frame.width, frame.height};
  for (int k = 1; k < kFreeLevels; ++k) {
    const int32_t width = texelsFor(frame.width, k), height = texelsFor(frame.height, k);
    float* const texels = levels_.data() + beginOf(k, frame);
    launch("makeFreeLevelKernel", makeFreeLevelKernel,
           blocksFor(static_cast<size_t>(width) * height), kThreads, 0, stream_, free.level[k - 1],
           texelsFor(frame.width, k - 1), texelsFor(frame.height, k - 1), width, height, texels);
    free.level[k] = texels;
  }
  return free;
}

std::vector<CubeMask> FreeCellFinder::take() {
  std::vector<CubeMask> seen;
  if (!keys_.empty()) fetched_.wait();
  for (size_t i = 0; i < keys_.size(); ++i) {
    if (!isEmpty(pinned_masks_[i])) seen.push_back({keys_[i], pinned_masks_[i]});
  }
  keys_.clear();
  return seen;
}

void FreeCellFinder::addMemory(MapperMemory& memory) const {
  addScratch(memory, levels_, cubes_, masks_, pinned_cubes_, pinned_masks_);
}

}  // namespace gpu
}  // namespace dtsdf
