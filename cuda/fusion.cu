#include "fusion.h"

#include <algorithm>

#include "backend/rule_settings.h"
#include "device_map.cuh"
#include "find_blocks.cuh"
#include "kernels/fusion/cast.h"
#include "kernels/fusion/free_space.h"
#include "kernels/fusion/voxel_projection.h"
#include "kernels/fusion/voxel_update.h"
#include "launch.h"
#include "named_kernels.h"
#include "runtime/device.h"
#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

/// Arrays of sums held at a time, 12 KiB each: a frame that touches more is fused in several
/// passes, so that a small GPU can fuse any frame.
constexpr uint32_t kMaxSumArrays = 16384;

/// Fetched with the counters of a frame; more take a second step.
constexpr size_t kEmptyBlocksAtOnce = 1024;
constexpr int kThreadBlocksPerProcessor = 8;

static_assert(sizeof(VoxelSums) == 3 * sizeof(unsigned long long), "summed by 64-bit atomics");

/// Adds a sample to the sums by integer atomics: the result does not depend on their order.
__device__ void addAtomically(VoxelSums* sums, int32_t weight, int32_t sdf, uint32_t point_key) {
  VoxelSums sample{};
  addToSums(sample, weight, sdf, point_key);
  atomicAdd(reinterpret_cast<unsigned long long*>(&sums->weighted_sdf),
            static_cast<unsigned long long>(sample.weighted_sdf));
  atomicAdd(reinterpret_cast<unsigned long long*>(&sums->weight),
            static_cast<unsigned long long>(sample.weight));
  if (sample.nearest != 0) atomicMax(&sums->nearest, sample.nearest);
}

/// One thread per surfel.
__global__ void castSurfelsKernel(DeviceSensing on_device, FusionSettings fusion,
                                  DeviceSurfels surfels, TouchedView touched, SumsView part) {
  const size_t i = globalThread();
  if (i >= surfels.size()) return;
  const FrameSensing sensing = on_device.load();
  const CastLine cast = makeCastLine(surfels.surfels[i], sensing, fusion);
  const Vec3i origin_block = blockOfVoxel(sensing.image.frame.origin_voxel);
  visitBlocks<BlockWalk::kQuick>(cast.line, [&](const Vec3i& block_L) {
    const int32_t place = findTouched(touched, packKey(block_L + origin_block));
    if (place < 0) return;
    const uint32_t present = touched.directions[place];
    const uint32_t first_sum = touched.first_sums[place] - part.first;
    auto add = [&](int direction, int index, int32_t weight, int32_t sdf, uint32_t point_key) {
      if (weight == 0) return;
      const uint32_t sum = first_sum + __popc(present & ((1u << direction) - 1u));
      if (sum >= part.count) return;
      addAtomically(&part.sums[static_cast<size_t>(sum) * kVoxelsPerBlock + index], weight, sdf,
                    point_key);
    };
    castIntoBlock(cast, fusion, block_L, add);
  });
}

/// Which voxels of the arrays of sums the frame supports, a bit each.
constexpr int kSupportWords = kVoxelsPerBlock / 32;

/// One block of threads per array of sums, which it leaves zeroed.
__global__ void foldSumsKernel(FrameView frame, FusionSettings fusion, FusionTarget target,
                               SumsView part, uint32_t* supported) {
  const MapView& map = target.map;
  const uint32_t owner = target.touched.sum_owners[part.first + blockIdx.x];
  TouchedBlock& block = target.touched.blocks[owner / 8];
  const int direction = owner % 8;
  const int32_t array = block.slot < 0 ? kNoArray : map.slots[block.slot].array[direction];
  VoxelSums* sums = part.sums + static_cast<size_t>(blockIdx.x) * kVoxelsPerBlock;
  Voxel* voxels = array == kNoArray ? nullptr : map.voxels.record(array);
  const float depth_weight = blockDepthWeight(frame, block.block_L, fusion.rules);
  uint32_t* words = supported + static_cast<size_t>(part.first + blockIdx.x) * kSupportWords;
  int observed = 0;
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) {
    if (voxels != nullptr) {
      const Voxel folded = foldSums(voxels[i], sums[i], depth_weight, fusion);
      voxels[i] = folded;
      observed |= !isEmpty(folded);
    }
    const uint32_t word = __ballot_sync(~0u, sums[i].weight != 0);
    if (i % 32 == 0) words[i / 32] = word;
    sums[i] = VoxelSums{};
  }
  const bool empty = !__syncthreads_or(observed) && voxels != nullptr;
  if (threadIdx.x == 0 && empty) atomicOr(&block.empty, 1u << direction);
}

/// One block of threads per touched block. A voxel takes a single pixel: its sums need no memory.
__global__ void projectVoxelsKernel(FrameView frame, FusionSettings fusion, const Surfel* surfels,
                                    FusionTarget target) {
  __shared__ uint32_t observed;
  const MapView& map = target.map;
  TouchedBlock& block = target.touched.blocks[blockIdx.x];
  if (block.slot < 0) return;
  if (threadIdx.x == 0) observed = 0;
  __syncthreads();
  const SlotEntry entry = map.slots[block.slot];
  const float depth_weight = blockDepthWeight(frame, block.block_L, fusion.rules);
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) {
    VoxelSums sums[kDirectionCount] = {};
    auto add = [&](int direction, int32_t weight, int32_t sdf, uint32_t point_key) {
      addToSums(sums[direction], weight, sdf, point_key);
    };
    projectVoxel(frame, fusion, surfels, firstVoxelOfBlock(block.block_L) + voxelOffset(i),
                 add);
    for (int d = 0; d < kDirectionCount; ++d) {
      if (entry.array[d] == kNoArray) continue;
      Voxel& voxel = map.voxels.record(entry.array[d])[i];
      voxel = foldSums(voxel, sums[d], depth_weight, fusion);
      if (!isEmpty(voxel)) atomicOr(&observed, 1u << d);
    }
  }
  __syncthreads();
  if (threadIdx.x == 0) block.empty = directionsOfSlot(entry) & ~observed;
}

/// What became of a block.
struct ClearedBlock {
  bool changed;
  uint32_t empty_directions;
};

/// The support of a touched block's voxels, for the directions that it has sums of.
struct BlockSupport {
  const uint32_t* words;  ///< Of its first array of sums; null: the frame does not touch it.
  uint32_t directions;

  __device__ const uint32_t* of(int direction) const {
    if (words == nullptr || !(directions >> direction & 1)) return nullptr;
    return words + __popc(directions & ((1u << direction) - 1u)) * kSupportWords;
  }
};

/// A frame's look at a block.
struct BlockLook {
  Vec3f first_voxel_L;
  bool in_turn;  ///< It is the block's turn.
  BlockSupport support;

  /// All octants: to find those that are hidden takes longer here than to judge their voxels.
  __device__ Look rule() const { return {in_turn, in_turn ? kAllOctants : 0u}; }
};

/// The voxels of a block that the frame judges.
struct JudgedVoxels {
  uint32_t count;
  uint32_t emptied_directions;  ///< That lose a voxel.
  uint16_t voxel[kDirectionCount * kVoxelsPerBlock];  ///< packJudged()
};
constexpr int kMostPerThread = kDirectionCount * kVoxelsPerBlock / kThreads;
static_assert(kMostPerThread <= 16, "two bits for each voxel that a thread judges");

constexpr uint32_t kCoveredBit = 1u << 15;
static_assert(kDirectionCount * kVoxelsPerBlock <= kCoveredBit, "a bit is left");

__device__ uint16_t packJudged(int direction, int voxel, bool is_covered) {
  return static_cast<uint16_t>(direction * kVoxelsPerBlock + voxel) |
         static_cast<uint16_t>(is_covered ? kCoveredBit : 0u);
}

struct JudgedVoxel {
  int direction, index;
  bool is_covered;
};

__device__ JudgedVoxel unpackJudged(uint16_t packed) {
  const int voxel = static_cast<int>(packed & (kCoveredBit - 1u));
  return {voxel / kVoxelsPerBlock, voxel % kVoxelsPerBlock, (packed & kCoveredBit) != 0};
}

/// A warp takes as long for one of them as for 32: so they are listed first.
__device__ void listJudged(const MapView& map, const FusionRules& rules, const SlotEntry& entry,
                           const BlockLook& look, JudgedVoxels& list) {
  __syncthreads();  // of the block before
  if (threadIdx.x == 0) list.count = list.emptied_directions = 0;
  __syncthreads();
  const Look rule = look.rule();
  const uint32_t lane = threadIdx.x % 32, before = (1u << lane) - 1u;
  for (int d = 0; d < kDirectionCount; ++d) {
    if (entry.array[d] == kNoArray) continue;
    const uint32_t* covered = look.support.of(d);
    if (covered == nullptr && !look.in_turn) continue;
    const Voxel* voxels = map.voxels.record(entry.array[d]);
    for (int i = threadIdx.x; i < kVoxelsPerBlock; i += kThreads) {
      const bool is_covered = covered != nullptr && (covered[i / 32] >> lane & 1u);
      const bool is_judged = isJudged(voxels[i], i, is_covered, rule, rules);
      const uint32_t judged = __ballot_sync(~0u, is_judged);
      uint32_t first = 0;
      if (lane == 0 && judged != 0) first = atomicAdd(&list.count, __popc(judged));
      first = __shfl_sync(~0u, first, 0);
      if (is_judged) list.voxel[first + __popc(judged & before)] = packJudged(d, i, is_covered);
    }
  }
  __syncthreads();
}

/// What the frame makes of the voxels on this thread's turn.
class Sights {
 public:
  __device__ void set(uint32_t turn, Sight sight) {
    bits_ |= static_cast<uint32_t>(sight) << (2 * turn);
  }
  __device__ Sight of(uint32_t turn) const { return static_cast<Sight>(bits_ >> (2 * turn) & 3u); }
  __device__ bool any() const { return bits_ != 0; }

 private:
  uint32_t bits_ = 0;
};

/// Holds only what changes a voxel.
__device__ Sights judgeVoxels(const FrameSensing& sensing, const FusionSettings& fusion,
                              const MapView& map, const SlotEntry& entry,
                              const Vec3f& first_voxel_L, const JudgedVoxels& list) {
  Sights sights;
  for (uint32_t k = threadIdx.x, turn = 0; k < list.count; k += kThreads, ++turn) {
    const JudgedVoxel voxel = unpackJudged(list.voxel[k]);
    const Sight sight =
        judge(sensing, first_voxel_L, map.voxels.record(entry.array[voxel.direction]), voxel.index,
              fusion.directional ? voxel.direction : kAnyDirection, voxel.is_covered);
    if (isAgainst(sight, voxel.is_covered)) sights.set(turn, sight);
  }
  return sights;
}

/// Whether an array holds nothing. By all threads of a block.
__device__ bool isArrayEmpty(const Voxel* voxels) {
  int holds = 0;
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += kThreads) holds |= !isEmpty(voxels[i]);
  return !__syncthreads_or(holds);
}

/// Takes evidence from the voxels that the frame sees through, with a block of threads: all are
/// judged before the first one changes.
__device__ ClearedBlock clearBlock(const FrameSensing& sensing, const FusionSettings& fusion,
                                   const MapView& map, const SlotEntry& entry,
                                   const BlockLook& look, JudgedVoxels& list) {
  listJudged(map, fusion.rules, entry, look, list);
  const Sights sights = judgeVoxels(sensing, fusion, map, entry, look.first_voxel_L, list);
  if (!__syncthreads_or(sights.any())) return {false, 0};  // as most
  int changed = 0;
  for (uint32_t k = threadIdx.x, turn = 0; k < list.count; k += kThreads, ++turn) {
    const Sight sight = sights.of(turn);
    if (sight == Sight::kSurface) continue;
    const auto [d, i, is_covered] = unpackJudged(list.voxel[k]);
    Voxel& voxel = map.voxels.record(entry.array[d])[i];
    const bool was_empty = isEmpty(voxel);
    const int32_t frames = framesAgainst(sight, is_covered, fusion.rules);
    voxel = contradictedVoxel(voxel, frames, is_covered, fusion.rules);
    changed |= !was_empty;
    if (was_empty || !isEmpty(voxel)) continue;
    forgetColour(map, entry.array[d], i);
    atomicOr(&list.emptied_directions, 1u << d);
  }
  ClearedBlock result{__syncthreads_or(changed) != 0, 0};
  for (int d = 0; d < kDirectionCount; ++d) {
    if (!(list.emptied_directions >> d & 1u)) continue;
    if (isArrayEmpty(map.voxels.record(entry.array[d]))) result.empty_directions |= 1u << d;
  }
  return result;
}

__device__ void listEmpty(const TouchedView& touched, EmptyBlock* empty_blocks, int32_t slot,
                          uint32_t directions) {
  if (directions == 0) return;
  empty_blocks[atomicAdd(&touched.counters->empty_blocks, 1u)] = {slot, directions};
}

/// One block of threads per touched block.
__global__ void clearBlocksKernel(DeviceSensing on_device, FusionSettings fusion,
                                  FusionTarget target, const uint32_t* supported,
                                  uint64_t frame_number, EmptyBlock* empty_blocks) {
  __shared__ JudgedVoxels list;
  const MapView& map = target.map;
  const TouchedView& touched = target.touched;
  const TouchedBlock& block = touched.blocks[blockIdx.x];
  if (block.slot < 0) return;
  uint32_t empty = block.empty;
  if (on_device.hasFreeDepth()) {
    const uint32_t first_sum = touched.first_sums[touched.places[blockIdx.x]];
    const BlockLook look{toFloat(firstVoxelOfBlock(block.block_L)),
                         isInTurn(map.slots[block.slot].key, frame_number, fusion.rules),
                         {supported + static_cast<size_t>(first_sum) * kSupportWords,
                          block.directions}};
    empty |= clearBlock(on_device.load(), fusion, map, map.slots[block.slot], look, list)
                 .empty_directions;
  }
  if (threadIdx.x != 0) return;
  listEmpty(touched, empty_blocks, block.slot, empty);
  markDirty(map, block.slot);
}

/// One thread per block that may be in view: lists those that the frame looks at untouched.
__global__ void findLooksKernel(FrameView frame, FusionRules rules, FusionTarget target,
                                uint64_t frame_number, LookList looks) {
  const size_t i = globalThread();
  if (i >= looks.in_view_count) return;
  const int32_t slot = looks.in_view[i];
  const PackedKey key = target.map.slots[slot].key;
  if (key == kNoKey || !isInTurn(key, frame_number, rules)) return;
  if (!mayBeInView(frame, unpackKey(key) - blockOfVoxel(frame.origin_voxel))) return;
  if (findTouched(target.touched, key) >= 0) return;
  looks.slots[atomicAdd(looks.count, 1u)] = slot;
}

/// One block of threads per block of the list, in strides.
__global__ void lookAroundKernel(DeviceSensing on_device, FusionSettings fusion,
                                 FusionTarget target, LookList looks, EmptyBlock* empty_blocks) {
  __shared__ JudgedVoxels list;
  const MapView& map = target.map;
  const FrameSensing sensing = on_device.load();
  const BlockKey origin = blockOfVoxel(sensing.image.frame.origin_voxel);
  const uint32_t count = *looks.count;
  for (uint32_t i = blockIdx.x; i < count; i += gridDim.x) {
    const int32_t slot = looks.slots[i];
    const SlotEntry& entry = map.slots[slot];
    const BlockLook look{toFloat(firstVoxelOfBlock(unpackKey(entry.key) - origin)), true,
                         {nullptr, 0}};
    const ClearedBlock cleared = clearBlock(sensing, fusion, map, entry, look, list);
    if (threadIdx.x != 0) continue;
    if (cleared.changed) markDirty(map, slot);
    listEmpty(target.touched, empty_blocks, slot, cleared.empty_directions);
  }
}

}  // namespace

Fusion::Fusion(const MapperParams& params, const Rules& rules, const Stream& stream)
    : casts_(castsSurfels(params)),
      fusion_(makeFusionSettings(params, rules.fusion)),
      stream_(stream),
      thread_blocks_(kThreadBlocksPerProcessor * multiprocessorCount()),
      look_count_(1) {}

/// With an eighth to spare rather than half: this is the most of what a frame needs.
void Fusion::reserveSums(uint32_t arrays) {
  if (static_cast<size_t>(arrays) * kVoxelsPerBlock <= sums_.capacity()) return;
  const size_t with_spare = std::min(arrays + arrays / 8, kMaxSumArrays);
  sums_.reserveExactly(with_spare * kVoxelsPerBlock, stream_);
  sums_.zero(stream_);
}

void Fusion::reserve(const FrameCounters& counters, size_t in_view) {
  if (casts_) {
    reserveSums(std::min(counters.touched_arrays, kMaxSumArrays));
    supported_.reserve(static_cast<size_t>(counters.touched_arrays) * kSupportWords, stream_);
    in_view_.reserve(in_view, stream_);
    pinned_in_view_.reserve(in_view);
    looks_.reserve(in_view, stream_);
  }
  empty_blocks_.reserve(counters.touched + in_view, stream_);
  pinned_empty_blocks_.reserve(kEmptyBlocksAtOnce);
}

void Fusion::castAndFold(const DeviceSensing& sensing, const DeviceSurfels& surfels,
                         const FusionTarget& target, const FrameCounters& counters) {
  if (!casts_) return project(sensing, surfels, target, counters.touched);
  const DeviceSurfels all{surfels.surfels, counters.usable_surfels, nullptr};
  const uint32_t room = static_cast<uint32_t>(sums_.capacity() / kVoxelsPerBlock);
  for (uint32_t first = 0; first < counters.touched_arrays; first += room) {
    const SumsView part{sums_.data(), first, std::min(room, counters.touched_arrays - first)};
    cast(sensing, all, target.touched, part);
    fold(sensing.frame(), target, part);
  }
}

void Fusion::cast(const DeviceSensing& sensing, const DeviceSurfels& surfels,
                  const TouchedView& touched, const SumsView& part) {
  const StageSpan span(stream_, Stage::kCast);
  castSurfelsKernel<<<blocksFor(surfels.room), kThreads, 0, stream_.get()>>>(
      sensing, fusion_, surfels, touched, part);
  DTSDF_CHECK_LAUNCH("castSurfelsKernel");
}

void Fusion::fold(const FrameView& frame, const FusionTarget& target, const SumsView& part) {
  const StageSpan span(stream_, Stage::kFold);
  foldSumsKernel<<<part.count, kThreads, 0, stream_.get()>>>(frame, fusion_, target, part,
                                                             supported_.data());
  DTSDF_CHECK_LAUNCH("foldSumsKernel");
}

/// Every voxel of the touched blocks takes the distance of its pixel.
void Fusion::project(const DeviceSensing& sensing, const DeviceSurfels& surfels,
                     const FusionTarget& target, uint32_t blocks) {
  const StageSpan span(stream_, Stage::kCast);
  projectVoxelsKernel<<<blocks, kThreads, 0, stream_.get()>>>(sensing.frame(), fusion_,
                                                              surfels.surfels, target);
  DTSDF_CHECK_LAUNCH("projectVoxelsKernel");
}

void Fusion::clear(const DeviceSensing& sensing, const FusionTarget& target,
                   const FrameCounters& counters, const LookTurn& turn) {
  const StageSpan span(stream_, Stage::kClear);
  if (counters.touched > 0) {  // else the frame only looks around
    clearBlocksKernel<<<counters.touched, kThreads, 0, stream_.get()>>>(
        sensing, fusion_, target, supported_.data(), turn.number, empty_blocks_.data());
    DTSDF_CHECK_LAUNCH("clearBlocksKernel");
  }
  if (sensing.hasFreeDepth() && !turn.in_view.empty()) lookAround(sensing, target, turn);
  DTSDF_CHECK_CUDA(cudaMemcpyAsync(pinned_counters_.data(), target.touched.counters,
                                   sizeof(FrameCounters), cudaMemcpyDeviceToHost, stream_.get()));
  empty_blocks_.download(pinned_empty_blocks_.data(),
                         std::min(kEmptyBlocksAtOnce, empty_blocks_.capacity()), stream_);
  stream_.record(cleared_);
  is_cleared_ = true;
}

/// The list of the frame before has left the pinned memory: that frame was waited for.
void Fusion::lookAround(const DeviceSensing& sensing, const FusionTarget& target,
                        const LookTurn& turn) {
  const size_t in_view = turn.in_view.size();
  std::copy(turn.in_view.begin(), turn.in_view.end(), pinned_in_view_.data());
  in_view_.upload(pinned_in_view_.data(), in_view, stream_);
  const LookList looks{in_view_.data(), static_cast<uint32_t>(in_view), looks_.data(),
                       look_count_.data()};
  look_count_.zero(stream_);
  findLooksKernel<<<blocksFor(in_view), kThreads, 0, stream_.get()>>>(
      sensing.frame(), fusion_.rules, target, turn.number, looks);
  DTSDF_CHECK_LAUNCH("findLooksKernel");
  lookAroundKernel<<<thread_blocks_, kThreads, 0, stream_.get()>>>(
      sensing, fusion_, target, looks, empty_blocks_.data());
  DTSDF_CHECK_LAUNCH("lookAroundKernel");
}

std::vector<EmptyBlock> Fusion::takeEmptyBlocks() {
  if (!is_cleared_) return {};
  cleared_.wait();
  is_cleared_ = false;
  const size_t count = pinned_counters_[0].empty_blocks;
  if (count > kEmptyBlocksAtOnce) {  // rare: most of them come with the counters
    pinned_empty_blocks_.reserve(count);
    empty_blocks_.download(pinned_empty_blocks_.data(), count, stream_);
    stream_.synchronize();
  }
  const EmptyBlock* first = pinned_empty_blocks_.data();
  std::vector<EmptyBlock> blocks(first, first + count);
  std::sort(blocks.begin(), blocks.end(),
            [](const EmptyBlock& a, const EmptyBlock& b) { return a.slot < b.slot; });
  return blocks;
}

void Fusion::addMemory(std::vector<MemoryPart>& parts) const {
  parts.push_back({"sums", MemoryKind::kScratch, sums_.bytes(), sums_.bytes()});
  const size_t lists =
      empty_blocks_.bytes() + supported_.bytes() + looks_.bytes() + in_view_.bytes();
  parts.push_back({"support and looks", MemoryKind::kScratch, lists, lists});
  const size_t staging = pinned_empty_blocks_.bytes() + pinned_in_view_.bytes();
  parts.push_back({"empty blocks and looks", MemoryKind::kStaging, staging, staging});
}

std::vector<NamedKernel> fusionKernels() {
  return {DTSDF_NAMED_KERNEL(castSurfelsKernel, 0), DTSDF_NAMED_KERNEL(foldSumsKernel, 0),
          DTSDF_NAMED_KERNEL(projectVoxelsKernel, 0), DTSDF_NAMED_KERNEL(clearBlocksKernel, 0),
          DTSDF_NAMED_KERNEL(findLooksKernel, 0), DTSDF_NAMED_KERNEL(lookAroundKernel, 0)};
}

}  // namespace gpu
}  // namespace dtsdf
