#include "distances.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "launch.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kWarp = 32, kWarps = kThreads / kWarp;
static_assert(kSectorSide == kWarp, "each x needs a lane");

/// Cells per thread along y in the first kernel, and along z in the second.
constexpr int kRowsPerThread = kSectorSide / kWarps, kCellsPerThread = kCubeSide;

constexpr int kMaxRing = 8;  // for distances up to 255 cells
constexpr int kMaxWords = 2 * kMaxRing + 1;
constexpr int kRowsAtOnce = 3 * kWarp;  ///< All rows within reach, for distances up to 32 cells.

/// Computes squared distances along x and y within planes of cells. One thread block per plane of a
/// stack of sectors (32 x 32 x 32 cells each).
__global__ void __launch_bounds__(kThreads)
    planeDistancesKernel(DistanceTask task, uint16_t* planes) {
  __shared__ uint32_t words[kRowsAtOnce * kMaxWords];
  __shared__ uint16_t along_x[kRowsAtOnce][kSectorSide];
  __shared__ uint32_t rows_with_any[kRowsAtOnce / kWarp];
  const SectorStack stack = task.stacks[blockIdx.y];
  const auto plane = static_cast<int32_t>(blockIdx.x);
  if (plane >= planesOf(stack.count, task.reach)) return;
  const int lane = threadIdx.x % kWarp, warp = threadIdx.x / kWarp;
  const int32_t side = windowSide(task.reach), rows = planesOf(1, task.reach);
  const int32_t z = plane - task.reach, y = kRowsPerThread * warp;
  int32_t least[kRowsPerThread];
  for (int32_t& value : least) value = kSquaredFar;
  for (int32_t begin = 0; begin < rows; begin += kRowsAtOnce) {
    const int32_t count = min(rows - begin, kRowsAtOnce);
    if (threadIdx.x < kRowsAtOnce / kWarp) rows_with_any[threadIdx.x] = 0;
    for (int32_t i = threadIdx.x; i < count * side; i += kThreads) {
      words[i] = surfacesInRow(task, stack, i % side, begin + i / side - task.reach, z);
    }
    __syncthreads();
    for (int32_t row = warp; row < count; row += kWarps) {
      const uint32_t* const of_row = words + row * side;
      const bool has_surface = __any_sync(~0u, lane < side && of_row[lane] != 0);
      if (!has_surface) continue;
      along_x[row][lane] = static_cast<uint16_t>(squaredAlongRow(of_row, lane, task.reach));
      if (lane == 0) atomicOr(&rows_with_any[row / kWarp], 1u << row % kWarp);
    }
    __syncthreads();
    for (int32_t part = 0; part < kRowsAtOnce / kWarp; ++part) {
      for (uint32_t left = rows_with_any[part]; left != 0; left &= left - 1) {
        const int32_t row = part * kWarp + lowestBit(left);
        const int32_t squared = along_x[row][lane];
        const int32_t aside = y - (begin + row - task.reach);
#pragma unroll
        for (int i = 0; i < kRowsPerThread; ++i) {
          least[i] = min(least[i], squared + (aside + i) * (aside + i));
        }
      }
    }
    __syncthreads();
  }
  const size_t number = stack.first_plane + plane;
  uint16_t* const out = planes + number * kSectorSide * kSectorSide + y * kSectorSide + lane;
  for (int i = 0; i < kRowsPerThread; ++i) {
    out[i * kSectorSide] = squaredWithin(least[i], task.reach);
  }
}
static_assert(kMaxWords <= kWarp, "each word needs a lane");

/// Takes the minimum of the planes' squared distances along z. One thread block per row of four
/// cubes of 8 x 8 x 8 cells.
__global__ void __launch_bounds__(kThreads)
    sectorDistancesKernel(DistanceTask task, const uint16_t* planes, const SquaresPlace* results,
                          uint32_t* is_near) {
  constexpr int kPad = 8;  // avoids bank conflicts when lanes write
  __shared__ __align__(16) uint16_t cubes[kCubesAlong][kCellsPerCube + kPad];
  waitForPreviousKernel();
  const SectorStack stack = task.stacks[blockIdx.y];
  const auto sector = static_cast<int32_t>(blockIdx.x) / (kCubesAlong * kCubesAlong);
  if (sector >= stack.count) return;
  const SquaresPlace result = results[stack.first + sector];
  const int32_t row = static_cast<int32_t>(blockIdx.x) % (kCubesAlong * kCubesAlong);
  const int32_t cube_y = row % kCubesAlong, cube_z = row / kCubesAlong;
  const int lane = threadIdx.x % kWarp, warp = threadIdx.x / kWarp;
  const int32_t first = stack.first_plane + kSectorSide * sector + kCubeSide * cube_z;
  const int32_t count = kCubeSide + 2 * task.reach;
  const uint16_t* const column = planes + static_cast<size_t>(first) * kSectorSide * kSectorSide +
                                 (kCubeSide * cube_y + warp) * kSectorSide + lane;
  int32_t least[kCellsPerThread];
  for (int32_t& value : least) value = kSquaredFar;
#pragma unroll 8
  for (int32_t plane = 0; plane < count; ++plane) {
    const int32_t squared = column[static_cast<size_t>(plane) * kSectorSide * kSectorSide];
    const int32_t aside = task.reach - plane;
#pragma unroll
    for (int i = 0; i < kCellsPerThread; ++i) {
      least[i] = min(least[i], squared + (aside + i) * (aside + i));
    }
  }
  bool is_any_near = false;
  for (int i = 0; i < kCellsPerThread; ++i) {
    const uint16_t squared = squaredWithin(least[i], task.reach);
    is_any_near = is_any_near || squared != kSquaredFar;
    cubes[lane / kCubeSide][cellIndex(lane % kCubeSide, warp, i)] = squared;
  }
  const int32_t number = stack.first + sector;
  if (__syncthreads_or(is_any_near) && threadIdx.x == 0) is_near[number] = 1;
  // Only warps with a changed value write to the host.
  constexpr int kSquaresPerThread = sizeof(uint4) / sizeof(uint16_t);
  const int at = threadIdx.x * kSquaresPerThread;
  const uint4 now = *reinterpret_cast<const uint4*>(&cubes[at / kCellsPerCube][at % kCellsPerCube]);
  const int place = row * kCubesAlong * kCellsPerCube + at;
  uint4* const known = reinterpret_cast<uint4*>(result.device + place);
  const uint4 before = result.is_new ? uint4{} : *known;  // new memory has no values yet
  const bool is_other = result.is_new || now.x != before.x || now.y != before.y ||
                        now.z != before.z || now.w != before.w;
  if (!__any_sync(~0u, is_other)) return;
  *known = now;
  *reinterpret_cast<uint4*>(result.host + place) = now;
}
static_assert(kWarps == kCubeSide, "each y needs a warp");
static_assert(kThreads * sizeof(uint4) == kCubesAlong * kCellsPerCube * sizeof(uint16_t),
              "each thread writes one uint4");

/// Copies a list to pinned memory. @return the address that it will have on the device.
template <class T>
const T* stage(const T* list, int32_t count, const char* device, char* pinned, size_t& used) {
  const size_t begin = used, bytes = static_cast<size_t>(count) * sizeof(T);
  if (bytes > 0) std::memcpy(pinned + begin, list, bytes);
  used += (bytes + 15) / 16 * 16;
  return reinterpret_cast<const T*>(device + begin);
}

}  // namespace

SquaresPlace SquaresPool::placeOf(std::shared_ptr<uint16_t[]>& squares) {
  if (const auto* const own = std::get_deleter<GiveBack>(squares)) {
    return {squares.get(), own->device, false};
  }
  const SquaresPlace place = take();
  squares.reset(place.host, GiveBack{shared_from_this(), place.device});
  return place;
}

SquaresPlace SquaresPool::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (free_.empty()) grow();
  const SquaresPlace place = free_.back();
  free_.pop_back();
  return place;
}

void SquaresPool::grow() {
  free_.reserve((chunks_.size() + 1) * kChunkSectors);
  PinnedBuffer<uint16_t> pinned;
  pinned.reserveExactly(kChunkSquares);
  chunks_.emplace_back(std::move(pinned), kChunkSquares);
  auto& [host, device] = chunks_.back();
  for (size_t at = 0; at < kChunkSquares; at += kCellsPerSector) {
    free_.push_back({host.data() + at, device.data() + at, true});
  }
}

bool SquaresPool::hasRoomFor(const std::vector<std::shared_ptr<uint16_t[]>>& squares,
                             size_t most_bytes) const {
  const auto places = static_cast<size_t>(
      std::count_if(squares.begin(), squares.end(), [](const std::shared_ptr<uint16_t[]>& some) {
        return std::get_deleter<GiveBack>(some) == nullptr;
      }));
  const std::lock_guard<std::mutex> lock(mutex_);
  const size_t chunks = chunks_.size() + (places + kChunkSectors - 1) / kChunkSectors;
  return places <= free_.size() || chunks * kChunkSquares * sizeof(uint16_t) <= most_bytes;
}

void SquaresPool::GiveBack::operator()(uint16_t* host) const noexcept {
  const std::lock_guard<std::mutex> lock(pool->mutex_);
  pool->free_.push_back({host, device, true});
}

size_t SquaresPool::bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return chunks_.size() * kChunkSquares * sizeof(uint16_t);
}

size_t SquaresPool::freeBytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return free_.size() * kCellsPerSector * sizeof(uint16_t);
}

DistanceTask DistanceComputer::upload(const DistanceTask& task, const SquaresPlace*& results) {
  constexpr size_t kAlignment = 5 * 16;  // to pad five lists
  const size_t most = task.stack_count * sizeof(SectorStack) + task.place_count * sizeof(int32_t) +
                      task.sector_count * sizeof(SurfaceCubes) +
                      task.cube_count * sizeof(CellMask) + task.wanted * sizeof(SquaresPlace) +
                      kAlignment;
  staged_.reserve(most);
  task_.reserve(most, stream_);
  size_t used = 0;
  const auto stageList = [&](auto* list, int32_t count) {
    return stage(list, count, task_.data(), staged_.data(), used);
  };
  DistanceTask on_device = task;
  on_device.cubes = stageList(task.cubes, task.cube_count);
  on_device.sectors = stageList(task.sectors, task.sector_count);
  on_device.stacks = stageList(task.stacks, task.stack_count);
  on_device.places = stageList(task.places, task.place_count);
  results = stageList(results_.data(), task.wanted);
  task_.upload(staged_.data(), used, stream_);
  return on_device;
}

bool DistanceComputer::make(const DistanceTask& task,
                            std::vector<std::shared_ptr<uint16_t[]>>& squares) {
  const auto wanted = static_cast<size_t>(task.wanted);
  if (!pool_->hasRoomFor(squares, max_bytes_)) return false;
  const auto planes = static_cast<size_t>(task.plane_count);
  results_.resize(wanted);
  is_near_.reserve(wanted);
  planes_.reserve(planes * kSectorSide * kSectorSide, stream_);
  for (size_t i = 0; i < wanted; ++i) {
    results_[i] = pool_->placeOf(squares[i]);
    is_near_[i] = 0;
  }
  const SquaresPlace* results = nullptr;
  const DistanceTask on_device = upload(task, results);
  const auto stacks = static_cast<unsigned>(task.stack_count);
  const int32_t max_sectors = (task.max_planes - 2 * task.reach) / kSectorSide;
  launch("planeDistancesKernel", planeDistancesKernel, dim3(task.max_planes, stacks), kThreads, 0,
         stream_, on_device, planes_.data());
  launchOverlapped("sectorDistancesKernel", sectorDistancesKernel,
                   dim3(max_sectors * kCubesAlong * kCubesAlong, stacks), kThreads, 0, stream_,
                   on_device, planes_.data(), results, is_near_.data());
  stream_.synchronize();
  for (size_t i = 0; i < wanted; ++i) {
    if (is_near_[i] == 0) squares[i].reset();
  }
  return true;
}

void DistanceComputer::addMemory(MapperMemory& memory) const {
  addScratch(memory, task_, planes_, staged_, is_near_);
  memory.scratch += pool_->bytes();
  memory.staging += pool_->freeBytes();
}

}  // namespace gpu
}  // namespace dtsdf
