#include "align.h"

#include "device_map.cuh"
#include "kernels/poses/voxel_reader.h"
#include "launch.h"

namespace dtsdf {
namespace gpu {
namespace {

/// Threads per block: few, so that even a small number of points occupies all multiprocessors.
constexpr int kAlignThreads = 64;
constexpr int kWarp = 32;

/// Threads per point in the search for the surface.
constexpr int kLanes = 4;

unsigned alignBlocks(size_t threads) {
  return static_cast<unsigned>((threads + kAlignThreads - 1) / kAlignThreads);
}

/// Number of integers in AlignmentSums.
constexpr int kSums = sizeof(AlignmentSums) / sizeof(int64_t);
static_assert(sizeof(AlignmentSums) % sizeof(int64_t) == 0, "must be 64-bit integers");
static_assert(kSums <= kAlignThreads, "each sum needs a thread");

/// Runs findSurface() with kLanes threads per point. Each thread tests different offsets along the
/// normal.
template <class VoxelAt>
__device__ FieldSample findSurfaceInLanes(const Vec3f& p_L, const Vec3f& normal, bool directional,
                                          float reach, VoxelAt& voxel) {
  const unsigned lane = threadIdx.x % kLanes, first = threadIdx.x % kWarp - lane;
  const unsigned lanes = ((1u << kLanes) - 1u) << first;
  const DirectionSet directions = directionsOf(normal, directional);
  const int32_t places = searchOffsetCount(reach);
  for (int32_t n = 0; n < places; n += kLanes) {
    FieldSample field{0.0f, {0.0f, 0.0f, 0.0f}, false};
    const int32_t place = n + static_cast<int32_t>(lane);
    if (place < places) {
      field = findPlane(p_L, normal, directions, searchOffset(place), voxel);
    }
    const unsigned found = __ballot_sync(lanes, field.known);
    if (found == 0) continue;
    const int from = __ffs(static_cast<int>(found)) - 1;
    const auto of_first = [&](float value) { return __shfl_sync(lanes, value, from); };
    return {of_first(field.sdf),
            {of_first(field.gradient.x), of_first(field.gradient.y), of_first(field.gradient.z)},
            true};
  }
  return {0.0f, {0.0f, 0.0f, 0.0f}, false};
}

/// One thread per point.
__global__ void __launch_bounds__(kAlignThreads)
    makeAlignedPointsKernel(FrameView view, RawDepth raw, AlignmentSettings settings,
                            AlignmentGrid grid, AlignedPoint* points) {
  const size_t i = globalThread();
  if (i >= static_cast<size_t>(grid.columns) * grid.rows) return;
  const Pixel pixel = pixelOfPoint(grid, static_cast<int32_t>(i));
  points[i] = makeAlignedPoint(view, pixel, settings, [&](int32_t du, int32_t dv) {
    return inverseDepthAt(raw, pixel.u + du, pixel.v + dv);
  });
}

/// Launched with kLanes threads per point. Each warp adds its sums to the totals. The last thread
/// block to finish copies the totals to the host and zeroes them, so a solver step needs only one
/// kernel.
__global__ void __launch_bounds__(kAlignThreads)
    addPointsKernel(FrameView view, bool directional, float cutoff, MapView map,
                    const AlignedPoint* points, size_t count, AlignmentSums* sums,
                    uint32_t* finished, AlignmentSums* host) {
  AlignmentSums own = {};
  const size_t i = globalThread() / kLanes;
  if (i < count) {
    const auto slotOf = [&](PackedKey key) { return findSlot(map, key); };
    const auto arrayOf = [&](int32_t slot, int direction) -> const Voxel* {
      const int32_t array = map.slots[slot].array[direction];
      return array == kNoArray ? nullptr : map.voxels.record(array);
    };
    VoxelReader reader(view.origin_voxel, slotOf, arrayOf);
    addPoint(own, view, points[i], cutoff, [&](const Vec3f& p_L, const Vec3f& normal) {
      return findSurfaceInLanes(p_L, normal, directional, cutoff, reader);
    });
  }
  const auto* values = reinterpret_cast<const int64_t*>(&own);
  auto* totals = reinterpret_cast<unsigned long long*>(sums);
  for (int k = 0; k < kSums; ++k) {
    auto value = static_cast<unsigned long long>(values[k]);
    for (int step = kWarp / 2; step >= kLanes; step /= 2) {  // lanes of a point hold the same value
      value += __shfl_down_sync(0xffffffffu, value, step);
    }
    if (threadIdx.x % kWarp == 0 && value != 0) atomicAdd(&totals[k], value);
  }
  if (!isLastBlock(finished, gridDim.x)) return;
  if (threadIdx.x == 0) *finished = 0;
  if (threadIdx.x >= kSums) return;
  reinterpret_cast<unsigned long long*>(host)[threadIdx.x] = readShared(&totals[threadIdx.x]);
  totals[threadIdx.x] = 0;
}

}  // namespace

PoseAligner::PoseAligner(const AlignmentSettings& settings, bool directional, const Stream& stream)
    : settings_(settings), directional_(directional), stream_(stream) {}

void PoseAligner::takePoints(const FrameView& view, const RawDepth& raw) {
  const AlignmentGrid grid = alignmentGrid(view, settings_.rules);
  point_count_ = static_cast<size_t>(grid.columns) * grid.rows;
  points_.reserveExactly(point_count_, stream_);
  sums_.reserveExactly(1, stream_);
  sums_.zero(stream_);
  finished_.reserveExactly(1, stream_);
  finished_.zero(stream_);
  pinned_sums_.reserve(1);
  has_pinned_points_ = false;
  if (point_count_ == 0) return;
  launch("makeAlignedPointsKernel", makeAlignedPointsKernel, alignBlocks(point_count_),
         kAlignThreads, 0, stream_, view, raw, settings_, grid, points_.data());
}

AlignmentSums PoseAligner::sumsAt(const FrameView& view, float cutoff, const MapView& map) {
  if (point_count_ == 0) return AlignmentSums{};
  launch("addPointsKernel", addPointsKernel, alignBlocks(kLanes * point_count_), kAlignThreads, 0,
         stream_, view, directional_, cutoff, map, points_.data(), point_count_, sums_.data(),
         finished_.data(), pinned_sums_.data());
  stream_.synchronize();
  return pinned_sums_[0];
}

std::vector<PackedKey> PoseAligner::keysAt(const FrameView& view, float cutoff) {
  if (!has_pinned_points_) {
    pinned_points_.reserve(point_count_);
    points_.download(pinned_points_.data(), point_count_, stream_);
    stream_.synchronize();
    has_pinned_points_ = true;
  }
  return alignedKeys(view, cutoff, pinned_points_.data(), point_count_);
}

void PoseAligner::addMemory(MapperMemory& memory) const {
  addScratch(memory, points_, sums_, finished_, pinned_points_, pinned_sums_);
}

}  // namespace gpu
}  // namespace dtsdf
