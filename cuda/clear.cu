#include "clear.h"

#include <algorithm>

#include "backend/rule_settings.h"
#include "device_map.cuh"
#include "find_blocks.cuh"
#include "kernels/fusion/free_space.h"
#include "launch.h"
#include "runtime/device.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kThreadBlocksPerProcessor = 8;

/// Initial capacity of the list of blocks in view.
constexpr size_t kFirstInView = 1 << 14;

struct VisitedBlock {
  int32_t slot;     ///< -1 if not in the map.
  bool is_touched;  ///< Whether the frame updates the block; false if it only checks it.
  uint32_t empty;   ///< Bit d: the array of direction d was empty after fusion.
  Vec3f first_voxel_L;
  bool in_turn;             ///< Whether to check voxels without sums as well.
  const uint32_t* covered;  ///< Voxels with sums in this frame, one bit each; null if untouched.
  uint32_t directions;      ///< Bit d: the block has sums for direction d.

  /// Voxels with sums in a direction, one bit each; null if the block has no sums for it.
  __device__ const uint32_t* coveredOf(int direction) const {
    if (covered == nullptr || !(directions >> direction & 1)) return nullptr;
    return covered + __popc(directions & ((1u << direction) - 1u)) * kCoverWords;
  }
};

/// The voxels of a block that the frame may contradict, that is, look through.
struct JudgedVoxels {
  uint32_t count;
  uint32_t emptied_directions;  ///< Bit d: a voxel of direction d lost its distance.
  uint16_t voxel[kDirectionCount * kVoxelsPerBlock];  ///< Packed by packJudged().
};

/// Threads per block of the map: one per voxel, to hide memory latency.
constexpr int kClearThreads = kVoxelsPerBlock;
constexpr int kMaxPerThread = kDirectionCount * kVoxelsPerBlock / kClearThreads;
static_assert(kMaxPerThread <= 16, "a thread's observations must fit in 32 bits");

constexpr uint32_t kCoveredBit = 1u << 15;
static_assert(kDirectionCount * kVoxelsPerBlock <= kCoveredBit, "kCoveredBit must be unused");

__device__ uint16_t packJudged(int direction, int voxel, bool is_covered) {
  return static_cast<uint16_t>(direction * kVoxelsPerBlock + voxel) |
         static_cast<uint16_t>(is_covered ? kCoveredBit : 0u);
}

/// Lists the voxels to be tested, so that all threads of a warp have work: a warp takes as long for
/// one voxel as for 32.
__device__ void listJudged(const MapView& map, const FusionRules& rules, const SlotEntry& entry,
                           const VisitedBlock& block, JudgedVoxels& list) {
  __syncthreads();  // no thread reads the previous list any longer
  if (threadIdx.x == 0) list.count = list.emptied_directions = 0;
  __syncthreads();
  const int i = threadIdx.x;
  const uint32_t lane = i % 32, before = (1u << lane) - 1u;
  Voxel voxel[kDirectionCount];
  uint32_t covered_word[kDirectionCount], looked_at = 0;
#pragma unroll  // all reads are issued before the first is needed
  for (int d = 0; d < kDirectionCount; ++d) {
    const uint32_t* covered = block.coveredOf(d);
    if (entry.array[d] == kNoArray || (covered == nullptr && !block.in_turn)) continue;
    looked_at |= 1u << d;
    voxel[d] = map.voxels.record(entry.array[d])[i];
    covered_word[d] = covered == nullptr ? 0 : covered[i / 32];
  }
#pragma unroll
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!(looked_at >> d & 1u)) continue;
    const bool is_covered = (covered_word[d] >> lane & 1u) != 0;
    const bool is_judged = isJudged(voxel[d], is_covered, block.in_turn, rules);
    const uint32_t judged = __ballot_sync(~0u, is_judged);
    if (judged == 0) continue;
    uint32_t first = 0;
    if (lane == 0) first = atomicAdd(&list.count, __popc(judged));
    first = __shfl_sync(~0u, first, 0);
    if (is_judged) list.voxel[first + __popc(judged & before)] = packJudged(d, i, is_covered);
  }
  __syncthreads();
}

/// The observations for this thread's voxels, two bits each; kOccupied where the frame does not
/// contradict the voxel.
__device__ uint32_t judgeVoxels(const FrameSensing& sensing, const FusionSettings& fusion,
                                const MapView& map, const SlotEntry& entry,
                                const Vec3f& first_voxel_L, const JudgedVoxels& list) {
  uint32_t observations = 0;
  for (uint32_t k = threadIdx.x, turn = 0; k < list.count; k += kClearThreads, ++turn) {
    const uint32_t judged = list.voxel[k] & (kCoveredBit - 1u);
    const bool is_covered = (list.voxel[k] & kCoveredBit) != 0;
    const int d = judged / kVoxelsPerBlock, i = judged % kVoxelsPerBlock;
    const Voxel* voxels = map.voxels.record(entry.array[d]);
    const Observation observation = judge(sensing, first_voxel_L, voxels, i,
                                          fusion.directional ? d : kAnyDirection, is_covered);
    if (contradicts(observation, voxels[i], is_covered, fusion.rules)) {
      observations |= static_cast<uint32_t>(observation) << (2 * turn);
    }
  }
  return observations;
}

/// Whether an array is empty. All threads of the thread block must call it.
__device__ bool isArrayEmpty(const Voxel* voxels) {
  int holds = 0;
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += kClearThreads) holds |= !isEmpty(voxels[i]);
  return !__syncthreads_or(holds);
}

/// Reduces the evidence of the voxels that the frame contradicts. All threads of the thread block
/// must call it; all voxels are tested before the first one changes.
/// @param changed Must be false; becomes true if a voxel with a distance lost evidence.
/// @return the directions whose arrays became empty.
__device__ uint32_t clearBlock(const FrameSensing& sensing, const FusionSettings& fusion,
                               const MapView& map, const SlotEntry& entry,
                               const VisitedBlock& block, JudgedVoxels& list, bool& changed) {
  listJudged(map, fusion.rules, entry, block, list);
  const uint32_t observations = judgeVoxels(sensing, fusion, map, entry, block.first_voxel_L, list);
  if (!__syncthreads_or(observations != 0)) return 0;  // the usual case
  int own_changed = 0;
  for (uint32_t k = threadIdx.x, turn = 0; k < list.count; k += kClearThreads, ++turn) {
    const auto observation = static_cast<Observation>(observations >> (2 * turn) & 3u);
    if (observation == Observation::kOccupied) continue;
    const uint32_t judged = list.voxel[k] & (kCoveredBit - 1u);
    const bool is_covered = (list.voxel[k] & kCoveredBit) != 0;
    const int d = judged / kVoxelsPerBlock, i = judged % kVoxelsPerBlock;
    Voxel& voxel = map.voxels.record(entry.array[d])[i];
    const bool was_empty = isEmpty(voxel);
    const int32_t frames = contradictionWeight(observation, is_covered, fusion.rules);
    voxel = contradictedVoxel(voxel, frames, is_covered, fusion.rules);
    own_changed |= !was_empty;
    if (was_empty || !isEmpty(voxel)) continue;
    forgetColour(map, entry.array[d], i);
    atomicOr(&list.emptied_directions, 1u << d);
  }
  changed = __syncthreads_or(own_changed) != 0;
  uint32_t empty_directions = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!(list.emptied_directions >> d & 1u)) continue;
    if (isArrayEmpty(map.voxels.record(entry.array[d]))) empty_directions |= 1u << d;
  }
  return empty_directions;
}

/// Lists an untouched block if the frame checks it, and counts it in FrameCounters. A block that
/// the host has released in the meantime has no arrays, so listing it changes nothing.
__device__ void findUntouched(const FrameView& frame, const FusionRules& rules, const MapView& map,
                              const TouchedView& touched, uint64_t frame_number, int32_t slot,
                              int32_t* untouched) {
  const PackedKey key = map.slots[slot].key;
  if (key == kNoKey || !isInTurn(key, frame_number, rules)) return;
  if (!mayBeInView(frame, unpackKey(key) - blockOfVoxel(frame.origin_voxel))) return;
  if (findTouched(touched, key) >= 0) return;
  untouched[atomicAdd(&touched.counters->untouched, 1u)] = slot;
}

/// One thread per block that may be in view. May overlap the previous kernel, which folds sums into
/// voxels: everything read here was written by earlier kernels.
__global__ void findBlocksToCheckKernel(FrameView frame, FusionRules rules, MapView map,
                                        TouchedView touched, uint64_t frame_number,
                                        const int32_t* in_view, uint32_t in_view_count,
                                        int32_t* untouched) {
  const auto i = static_cast<uint32_t>(globalThread());
  if (i < in_view_count)
    findUntouched(frame, rules, map, touched, frame_number, in_view[i], untouched);
  waitAtEnd();
}

__device__ VisitedBlock visitTouched(const MapView& map, const TouchedView& touched,
                                     const uint32_t* covered, const FusionRules& rules,
                                     uint64_t frame_number, uint32_t i) {
  const TouchedBlock& block = touched.blocks[i];
  const int32_t slot = slotOf(map, block);
  if (slot < 0) return {-1, true, 0, {}, false, nullptr, 0};
  const uint32_t first_sum = touched.first_sums[touched.places[i]];
  return {slot,
          true,
          block.empty,
          toFloat(firstVoxelOfBlock(block.block_L)),
          isInTurn(block.key, frame_number, rules),
          covered + static_cast<size_t>(first_sum) * kCoverWords,
          block.directions};
}

/// Describes an untouched block that the frame checks.
__device__ VisitedBlock visitUntouched(const MapView& map, const FrameView& frame, int32_t slot) {
  const Vec3i block_L = unpackKey(map.slots[slot].key) - blockOfVoxel(frame.origin_voxel);
  return {slot, false, 0, toFloat(firstVoxelOfBlock(block_L)), true, nullptr, 0};
}

/// Removes arrays from a slot's entry. The host updates its table later.
__device__ void dropArrays(SlotEntry& entry, uint32_t directions) {
  for (int d = 0; d < kDirectionCount; ++d) {
    if (directions >> d & 1u) entry.array[d] = kNoArray;
  }
}

/// One thread block per touched or untouched block, in a grid-stride loop. The list of blocks with
/// empty arrays is in host memory; the last thread block to finish writes its length.
__global__ void __launch_bounds__(kClearThreads, 3)
    clearBlocksKernel(DeviceSensing on_device, FusionSettings fusion, MapView map,
                      TouchedView touched, const uint32_t* covered, uint64_t frame_number,
                      const int32_t* untouched, EmptyBlock* empty_blocks, uint32_t* empty_count) {
  waitForPreviousKernel();
  __shared__ JudgedVoxels list;
  FrameCounters* counters = touched.counters;
  const FrameSensing sensing = on_device.load();
  const uint32_t touched_count = counters->touched, count = touched_count + counters->untouched;
  for (uint32_t i = blockIdx.x; i < count; i += gridDim.x) {
    const VisitedBlock block =
        i < touched_count ? visitTouched(map, touched, covered, fusion.rules, frame_number, i)
                          : visitUntouched(map, sensing.image.frame, untouched[i - touched_count]);
    if (block.slot < 0) continue;
    bool changed = false;
    uint32_t directions = block.empty;
    if (on_device.hasFreeDepth()) {
      directions |= clearBlock(sensing, fusion, map, map.slots[block.slot], block, list, changed);
    }
    if (threadIdx.x != 0) continue;
    if (directions != 0) {
      empty_blocks[atomicAdd(&counters->empty_blocks, 1u)] = {block.slot, directions};
      dropArrays(map.slots[block.slot], directions);
    }
    if (block.is_touched || changed) mark(map.dirty, block.slot);
  }
  if (!isLastBlock(&counters->cleared, gridDim.x)) return;
  if (threadIdx.x == 0) *empty_count = readShared(&counters->empty_blocks);
}

/// Empties voxels in a region. One thread block per slot.
__global__ void emptyRegionKernel(MapView map, RegionView region, const int32_t* slots,
                                  EmptiedBlock* emptied) {
  __shared__ uint32_t voxels_emptied;
  if (threadIdx.x == 0) voxels_emptied = 0;
  __syncthreads();
  const SlotEntry& entry = map.slots[slots[blockIdx.x]];
  const Vec3i first = firstVoxelOfBlock(unpackKey(entry.key));
  uint32_t empty_directions = 0;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    Voxel* voxels = map.voxels.record(entry.array[d]);
    int holds = 0, count = 0;
    for (int i = threadIdx.x; i < kVoxelsPerBlock; i += kThreads) {
      const bool is_empty = isEmpty(voxels[i]);
      if (!isInside(region, first + voxelOffset(i))) {
        holds |= !is_empty;
        continue;
      }
      voxels[i] = Voxel{};
      if (is_empty) continue;
      forgetColour(map, entry.array[d], i);
      ++count;
    }
    if (count > 0) atomicAdd(&voxels_emptied, static_cast<uint32_t>(count));
    const bool changed = __syncthreads_or(count);
    const bool empty = !__syncthreads_or(holds);
    if (changed && empty) empty_directions |= 1u << d;
  }
  __syncthreads();
  if (threadIdx.x == 0) emptied[blockIdx.x] = {voxels_emptied, empty_directions};
}

}  // namespace

Clearing::Clearing(const MapperParams& params, const Rules& rules, const Stream& stream)
    : clears_(castsSurfels(params)),
      fusion_(makeFusionSettings(params, rules)),
      stream_(stream),
      thread_blocks_(kThreadBlocksPerProcessor * multiprocessorCount()),
      in_view_(kFirstInView),
      looks_(kFirstInView),
      empty_blocks_(2 * kFirstInView) {}

void Clearing::reserve(const FrameCounters& counters, size_t in_view) {
  if (clears_) {
    in_view_.reserve(in_view);
    looks_.reserve(in_view, stream_);
  }
  empty_blocks_.reserve(counters.touched + in_view);
}

/// The previous frame is finished, so no kernel reads in_view_ any longer.
void Clearing::storeInView(const DeviceSensing& sensing, const std::vector<int32_t>& in_view) {
  in_view_count_ = sensing.hasFreeDepth() ? static_cast<uint32_t>(in_view.size()) : 0;
  std::copy_n(in_view.begin(), in_view_count_, in_view_.data());
}

void Clearing::findBlocksToCheck(const DeviceSensing& sensing, const MapView& map,
                                 const TouchedView& touched, uint64_t frame_number) {
  if (in_view_count_ == 0) return;
  launchOverlapped("findBlocksToCheckKernel", findBlocksToCheckKernel, blocksFor(in_view_count_),
                   kThreads, 0, stream_, sensing.frame(), fusion_.rules, map, touched, frame_number,
                   in_view_.data(), in_view_count_, looks_.data());
}

void Clearing::clear(const DeviceSensing& sensing, const MapView& map, const TouchedView& touched,
                     const FrameCounters& counters, const uint32_t* covered,
                     uint64_t frame_number) {
  const uint32_t untouched = std::min(in_view_count_, static_cast<uint32_t>(thread_blocks_));
  const uint32_t blocks = std::max(counters.touched + untouched, 1u);  // one writes the count
  launchOverlapped("clearBlocksKernel", clearBlocksKernel, blocks, kClearThreads, 0, stream_,
                   sensing, fusion_, map, touched, covered, frame_number, looks_.data(),
                   empty_blocks_.data(), empty_count_.data());
  stream_.record(cleared_);
  is_cleared_ = true;
}

std::vector<EmptyBlock> Clearing::takeEmptyBlocks() {
  if (!is_cleared_) return {};
  cleared_.wait();
  is_cleared_ = false;
  const EmptyBlock* first = empty_blocks_.data();
  std::vector<EmptyBlock> blocks(first, first + empty_count_[0]);
  std::sort(blocks.begin(), blocks.end(),
            [](const EmptyBlock& a, const EmptyBlock& b) { return a.slot < b.slot; });
  return blocks;
}

void Clearing::addMemory(MapperMemory& memory) const {
  addScratch(memory, looks_, empty_blocks_, in_view_);
}

std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots, const RegionView& region,
                                      const MapView& map, const Stream& stream) {
  if (slots.empty()) return {};
  PinnedBuffer<int32_t> where(slots.size());         // read in place by the kernel
  PinnedBuffer<EmptiedBlock> emptied(slots.size());  // written in place by the kernel
  std::copy(slots.begin(), slots.end(), where.data());
  launch("emptyRegionKernel", emptyRegionKernel, static_cast<unsigned>(slots.size()), kThreads, 0,
         stream, map, region, where.data(), emptied.data());
  stream.synchronize();
  return {emptied.data(), emptied.data() + slots.size()};
}

}  // namespace gpu
}  // namespace dtsdf
