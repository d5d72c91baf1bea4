#include "fusion.h"

#include <algorithm>

#include "device_map.cuh"
#include "kernels/fusion/free_space.h"
#include "named_kernels.h"
#include "runtime/stage_clock.h"
#include "touched_blocks.cuh"

namespace dtsdf {
namespace gpu {
namespace {

/// Arrays of sums held at a time, 8 KiB each: a frame that touches more is fused in several passes,
/// so that a small GPU can fuse any frame.
constexpr uint32_t kMaxSumArrays = 16384;

static_assert(sizeof(VoxelSums) == 2 * sizeof(unsigned long long), "summed by 64-bit atomics");

/// Adds a sample to the sums by integer atomics: the result does not depend on their order.
__device__ void addAtomically(VoxelSums* sums, int32_t weight, int32_t sdf) {
  VoxelSums sample{0, 0};
  addToSums(sample, weight, sdf);
  atomicAdd(reinterpret_cast<unsigned long long*>(&sums->weighted_sdf),
            static_cast<unsigned long long>(sample.weighted_sdf));
  atomicAdd(reinterpret_cast<unsigned long long*>(&sums->weight),
            static_cast<unsigned long long>(sample.weight));
}

/// A stretch of blocks along one axis.
struct BlockSpan {
  int first, last;
};

__device__ BlockSpan spanOf(int a, int b) {
  return {min(a, b) >> kBlockSideLog2, (max(a, b) + 1) >> kBlockSideLog2};
}

/// Calls visit(block) once for every block that may hold samples of a line. A line moves steadily
/// across its planes, so the ends of each layer of blocks bound what lies between.
template <class Visit>
__device__ void visitBlocksOnce(const SampleLine& line, const Visit& visit) {
  const int last_layer = line.last_plane >> kBlockSideLog2;
  for (int layer = line.first_plane >> kBlockSideLog2; layer <= last_layer; ++layer) {
    const int first = max(line.first_plane, layer * kBlockSide);
    const int last = min(line.last_plane, layer * kBlockSide + kBlockSide - 1);
    const PlaneCrossing a = crossPlane(line, first), b = crossPlane(line, last);
    const BlockSpan u = spanOf(a.u, b.u), v = spanOf(a.v, b.v);
    for (int block_u = u.first; block_u <= u.last; ++block_u) {
      for (int block_v = v.first; block_v <= v.last; ++block_v) {
        visit(unpermute(line.axis, layer, block_u, block_v));
      }
    }
  }
}

/// One thread per surfel.
__global__ void castSurfelsKernel(FusionInput input, uint32_t count, TouchedView touched,
                                  SumsView part) {
  const size_t i = globalThread();
  if (i >= count) return;
  const CastLine cast = makeCastLine(input.frame, input.fusionOfFrame(), input.surfels[i]);
  const Vec3i origin_block = blockOfVoxel(input.frame.origin_voxel);
  visitBlocksOnce(cast.line, [&](const Vec3i& block_L) {
    const int32_t place = findTouched(touched, packKey(block_L + origin_block));
    if (place < 0) return;
    const uint32_t present = touched.directions[place];
    const uint32_t first_sum = touched.first_sums[place] - part.first;
    auto add = [&](int direction, int index, int32_t weight, int32_t sdf) {
      if (weight == 0) return;
      const uint32_t sum = first_sum + __popc(present & ((1u << direction) - 1u));
      if (sum >= part.count) return;
      addAtomically(&part.sums[static_cast<size_t>(sum) * kVoxelsPerBlock + index], weight, sdf);
    };
    castIntoBlock<1>(cast, input.fusion, block_L, add);
  });
}

/// One block of threads per array of sums, which it leaves zeroed.
__global__ void foldSumsKernel(FusionView fusion, MapView map, TouchedView touched, SumsView part) {
  const uint32_t owner = touched.sum_owners[part.first + blockIdx.x];
  TouchedBlock& block = touched.blocks[owner / 8];
  const int direction = owner % 8;
  const int32_t array = block.slot < 0 ? kNoArray : map.slots[block.slot].array[direction];
  VoxelSums* sums = part.sums + static_cast<size_t>(blockIdx.x) * kVoxelsPerBlock;
  Voxel* voxels = array == kNoArray ? nullptr : map.voxels.record(array);
  int observed = 0;
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) {
    if (voxels != nullptr) {
      const Voxel folded =
          foldSums(voxels[i], sums[i], fusion.truncation_voxels, fusion.max_weight);
      voxels[i] = folded;
      observed |= folded.weight != 0.0f;
    }
    sums[i] = {0, 0};
  }
  const bool empty = !__syncthreads_or(observed) && voxels != nullptr;
  if (threadIdx.x == 0 && empty) atomicOr(&block.empty, 1u << direction);
}

/// One block of threads per touched block. A voxel takes a single pixel: its sums need no memory.
__global__ void projectVoxelsKernel(FusionInput input, MapView map, TouchedView touched) {
  __shared__ uint32_t observed;
  TouchedBlock& block = touched.blocks[blockIdx.x];
  if (block.slot < 0) return;
  if (threadIdx.x == 0) observed = 0;
  __syncthreads();
  const SlotEntry entry = map.slots[block.slot];
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) {
    VoxelSums sums[kDirectionCount] = {};
    auto add = [&](int direction, int32_t weight, int32_t sdf) {
      addToSums(sums[direction], weight, sdf);
    };
    projectVoxel(input.frame, input.fusion, input.surfels,
                 firstVoxelOfBlock(block.block_L) + voxelOffset(i), add);
    for (int d = 0; d < kDirectionCount; ++d) {
      if (entry.array[d] == kNoArray) continue;
      Voxel& voxel = map.voxels.record(entry.array[d])[i];
      voxel = foldSums(voxel, sums[d], input.fusion.truncation_voxels, input.fusion.max_weight);
      if (voxel.weight != 0.0f) atomicOr(&observed, 1u << d);
    }
  }
  __syncthreads();
  if (threadIdx.x == 0) block.empty = directionsOfSlot(entry) & ~observed;
}

/// Takes weight from the voxels of a block that the frame saw as free, with a block of threads.
__device__ void clearFreeSpace(const FusionInput& input, const MapView& map, const SlotEntry& entry,
                               const Vec3i& block_L) {
  const Vec3i first = firstVoxelOfBlock(block_L);
  for (int i = threadIdx.x; i < kVoxelsPerBlock; i += blockDim.x) {
    const VoxelInImage at = projectToImage(input.frame, first + voxelOffset(i));
    const float evidence = freeEvidence(input.frame, input.free_depth, at);
    if (!(evidence > 0.0f)) continue;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (entry.array[d] == kNoArray) continue;
      Voxel& voxel = map.voxels.record(entry.array[d])[i];
      voxel = clearedVoxel(voxel, evidence);
    }
  }
}

/// One block of threads per touched block. A block without anything in it is about to be released:
/// it is not meshed.
__global__ void finishBlocksKernel(FusionInput input, MapView map, TouchedView touched,
                                   EmptyBlock* empty_blocks) {
  const TouchedBlock& block = touched.blocks[blockIdx.x];
  if (block.slot < 0) return;
  const SlotEntry& entry = map.slots[block.slot];
  if (input.free_depth != nullptr) clearFreeSpace(input, map, entry, block.block_L);
  if (threadIdx.x != 0) return;
  if (block.empty != 0) {
    empty_blocks[atomicAdd(&touched.counters->empty_blocks, 1u)] = {block.slot, block.empty};
  }
  if ((directionsOfSlot(entry) & ~block.empty) == 0) return;
  if (atomicExch(&map.dirty[block.slot], 1u) == 0) {
    map.dirty_slots[atomicAdd(map.dirty_count, 1u)] = block.slot;
  }
}

}  // namespace

/// With an eighth to spare rather than half: this is the most of what a frame needs.
void Fusion::reserveSums(uint32_t arrays) {
  if (static_cast<size_t>(arrays) * kVoxelsPerBlock <= sums_.capacity()) return;
  const size_t with_spare = std::min(arrays + arrays / 8, kMaxSumArrays);
  sums_.reserveExactly(with_spare * kVoxelsPerBlock, stream_);
  sums_.zero(stream_);
}

void Fusion::reserve(const FrameCounters& counters, FusionMode mode) {
  if (mode != FusionMode::kVoxelProjection) {
    const uint32_t arrays = std::min(counters.touched_arrays, kMaxSumArrays);
    reserveSums(arrays);
  }
  empty_blocks_.growZeroed(counters.requests, stream_);
  pinned_empty_blocks_.reserve(counters.requests);
}

void Fusion::castSurfels(const FusionInput& input, const MapView& map, const TouchedView& touched,
                         const FrameCounters& counters) {
  const uint32_t room = static_cast<uint32_t>(sums_.capacity() / kVoxelsPerBlock);
  for (uint32_t first = 0; first < counters.touched_arrays; first += room) {
    const SumsView part{sums_.data(), first, std::min(room, counters.touched_arrays - first)};
    {
      const StageSpan span(stream_, Stage::kCast);
      castSurfelsKernel<<<blocksFor(counters.usable_surfels), kThreads, 0, stream_.get()>>>(
          input, counters.usable_surfels, touched, part);
      DTSDF_CHECK_LAUNCH("castSurfelsKernel");
    }
    const StageSpan span(stream_, Stage::kFold);
    foldSumsKernel<<<part.count, kThreads, 0, stream_.get()>>>(input.fusion, map, touched, part);
    DTSDF_CHECK_LAUNCH("foldSumsKernel");
  }
}

void Fusion::projectVoxels(const FusionInput& input, const MapView& map,
                           const TouchedView& touched, const FrameCounters& counters) {
  const StageSpan span(stream_, Stage::kFold);
  projectVoxelsKernel<<<counters.touched, kThreads, 0, stream_.get()>>>(input, map, touched);
  DTSDF_CHECK_LAUNCH("projectVoxelsKernel");
}

void Fusion::finish(const FusionInput& input, const MapView& map, const TouchedBlocks& touched,
                    const FrameCounters& counters, size_t new_blocks) {
  const StageSpan span(stream_, Stage::kFinish);
  finishBlocksKernel<<<counters.touched, kThreads, 0, stream_.get()>>>(
      input, map, touched.view(), empty_blocks_.data());
  DTSDF_CHECK_LAUNCH("finishBlocksKernel");
  has_new_blocks_ = new_blocks > 0;
  if (!has_new_blocks_) return;
  // Only new arrays can be empty (kLeastDebt), so there are no more of them to fetch.
  touched.counters().download(pinned_counters_.data(), 1, stream_);
  empty_blocks_.download(pinned_empty_blocks_.data(), new_blocks, stream_);
  stream_.record(finished_);
}

std::vector<EmptyBlock> Fusion::takeEmptyBlocks() {
  if (!has_new_blocks_) return {};
  finished_.wait();
  has_new_blocks_ = false;
  const EmptyBlock* first = pinned_empty_blocks_.data();
  std::vector<EmptyBlock> blocks(first, first + pinned_counters_[0].empty_blocks);
  std::sort(blocks.begin(), blocks.end(),
            [](const EmptyBlock& a, const EmptyBlock& b) { return a.slot < b.slot; });
  return blocks;
}

void Fusion::addMemory(std::vector<MemoryPart>& parts) const {
  parts.push_back({"sums", MemoryKind::kScratch, sums_.bytes(), sums_.bytes()});
  parts.push_back({"empty blocks", MemoryKind::kScratch, empty_blocks_.bytes(),
                   empty_blocks_.bytes()});
  parts.push_back({"empty blocks", MemoryKind::kStaging, pinned_empty_blocks_.bytes(),
                   pinned_empty_blocks_.bytes()});
}

std::vector<NamedKernel> fusionKernels() {
  return {DTSDF_NAMED_KERNEL(castSurfelsKernel, 0), DTSDF_NAMED_KERNEL(foldSumsKernel, 0),
          DTSDF_NAMED_KERNEL(projectVoxelsKernel, 0), DTSDF_NAMED_KERNEL(finishBlocksKernel, 0)};
}

}  // namespace gpu
}  // namespace dtsdf
