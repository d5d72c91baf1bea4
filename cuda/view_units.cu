#include "view_units.h"

#include "kernels/render/depth_range.h"
#include "launch.h"
#include "named_kernels.h"
#include "unit_samples.cuh"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kMakeThreads = 128;
constexpr unsigned kAllLanes = 0xffffffffu;

__device__ BlockKey localBlock(const SlotEntry& entry, const FrameView& frame) {
  return unpackKey(entry.key) - blockOfVoxel(frame.origin_voxel);
}

/// Slot of the block by a block, at the corner of its last unit.
__device__ int32_t slotBeside(const MapView& map, const BlockKey& key, int c) {
  const BlockKey beside = key + Vec3i{c & 1, c >> 1 & 1, c >> 2};
  return isRepresentable(beside) ? findSlot(map, packKey(beside)) : -1;
}

struct JoinedLayer {
  uint64_t known, behind;
};

/// A layer of the bits of four blocks side by side, joined. `upper`: of the blocks above.
__device__ JoinedLayer joinLayer(const MapView& map, const VoxelBits* bits, const BlockKey& key,
                                 bool upper, int z) {
  LayersAround known, behind;
  for (int c = 0; c < 4; ++c) {
    const int32_t slot = slotBeside(map, key, upper ? c + 4 : c);
    known.of[c] = slot < 0 ? 0 : bits[slot].known.layer[z];
    behind.of[c] = slot < 0 ? 0 : bits[slot].behind.layer[z];
  }
  return {joinInLayer<AllOf>(known), joinInLayer<AnyOf>(behind)};
}

/// One thread per layer of a block; those of a block stand side by side in a warp.
__global__ void __launch_bounds__(kThreads)
    placeUnitsKernel(MapView map, ViewScene scene, ViewUnits view) {
  const size_t i = globalThread();
  const size_t slot = i / kBlockSide;
  const int z = static_cast<int>(i % kBlockSide);
  const bool is_block = slot < map.slot_count && map.slots[slot].key != kNoKey;
  JoinedLayer here{0, 0}, last{0, 0};
  if (is_block && mayReachView(scene.frame, localBlock(map.slots[slot], scene.frame))) {
    const BlockKey key = unpackKey(map.slots[slot].key);
    here = joinLayer(map, view.bits, key, false, z);
    if (z == kBlockSide - 1) last = joinLayer(map, view.bits, key, true, 0);
  }
  const uint64_t known_above = __shfl_down_sync(kAllLanes, here.known, 1, kBlockSide);
  const uint64_t behind_above = __shfl_down_sync(kAllLanes, here.behind, 1, kBlockSide);
  const bool is_last = z == kBlockSide - 1;
  const uint64_t known = AllOf::join(here.known, is_last ? last.known : known_above);
  const uint64_t behind = AnyOf::join(here.behind, is_last ? last.behind : behind_above);
  const uint64_t made = known & behind;
  const auto own = static_cast<uint32_t>(__popcll(made));
  uint32_t up_to_here = own;
  for (int step = 1; step < kBlockSide; step *= 2) {
    const uint32_t below = __shfl_up_sync(kAllLanes, up_to_here, step, kBlockSide);
    if (z >= step) up_to_here += below;
  }
  uint32_t first = 0;
  if (is_last && up_to_here > 0) first = atomicAdd(view.count, up_to_here);
  first = __shfl_sync(kAllLanes, first, kBlockSide - 1, kBlockSide);
  if (!is_block) return;
  UnitPlaces& places = view.places[slot];
  places.known.layer[z] = known;
  places.made.layer[z] = made;
  places.before[z] = static_cast<uint16_t>(up_to_here - own);
  if (z == 0) places.first = first;
}

/// One block of threads per block of the map, one thread per unit that is to be made.
__global__ void __launch_bounds__(kMakeThreads)
    makeUnitsKernel(MapView map, ViewScene scene, ViewUnits view) {
  __shared__ int32_t slots[kCubeCorners];
  __shared__ uint16_t chosen[kVoxelsPerBlock];
  const SlotEntry& entry = map.slots[blockIdx.x];
  if (entry.key == kNoKey) return;
  const UnitPlaces& places = view.places[blockIdx.x];
  constexpr int kLast = kBlockSide - 1;
  const int count = places.before[kLast] + __popcll(places.made.layer[kLast]);
  if (count == 0) return;
  if (threadIdx.x < kCubeCorners) {
    slots[threadIdx.x] = slotBeside(map, unpackKey(entry.key), static_cast<int>(threadIdx.x));
  }
  for (int i = static_cast<int>(threadIdx.x); i < kVoxelsPerBlock; i += kMakeThreads) {
    constexpr int kInLayer = kBlockSide * kBlockSide;
    const int z = i / kInLayer, bit = i % kInLayer;
    const uint64_t made = places.made.layer[z];
    if ((made >> bit & 1) == 0) continue;
    chosen[places.before[z] + __popcll(made & ((uint64_t{1} << bit) - 1))] =
        static_cast<uint16_t>(i);
  }
  __syncthreads();
  const Vec3i first = firstVoxelOfBlock(localBlock(entry, scene.frame));
  for (int k = static_cast<int>(threadIdx.x); k < count; k += kMakeThreads) {
    const Vec3i offset = voxelOffset(chosen[k]);
    ReadSamples samples{map, scene.least_evidence, {}, 0};
    for (int c = 0; c < kCubeCorners; ++c) {
      const Vec3i at = offset + Vec3i{c & 1, c >> 1 & 1, c >> 2};
      const int block =
          (at.x >> kBlockSideLog2) | (at.y >> kBlockSideLog2) << 1 | (at.z >> kBlockSideLog2) << 2;
      samples.corner[c] = {slots[block], voxelIndex(at.x & kLast, at.y & kLast, at.z & kLast)};
    }
    samples.observed = observedBy(samples);
    const Vec3f middle = toFloat(first + offset) + Vec3f{0.5f, 0.5f, 0.5f};
    view.units[places.first + k] = makeRayUnit(
        *scene.tables, scene.rules, samples, scene.directional != 0, middle - scene.frame.T_L_C.t);
  }
}

}  // namespace

ViewUnits UnitMaker::view() const {
  return {bits_.data(), places_.data(), units_.data(), count_.data()};
}

ViewUnits UnitMaker::begin(const MapView& map) {
  bits_.reserve(map.slot_count, stream_);
  places_.reserve(map.slot_count, stream_);
  count_.reserveExactly(1, stream_);
  pinned_count_.reserve(1);
  count_.zero(stream_);
  return view();
}

ViewUnits UnitMaker::make(const ViewScene& scene, const MapView& map) {
  if (map.slot_count == 0) return view();
  const size_t layers = static_cast<size_t>(map.slot_count) * kBlockSide;
  placeUnitsKernel<<<blocksFor(layers), kThreads, 0, stream_.get()>>>(map, scene, view());
  DTSDF_CHECK_LAUNCH("placeUnitsKernel");
  count_.download(pinned_count_.data(), 1, stream_);
  stream_.synchronize();
  units_.reserve(pinned_count_[0], stream_);
  makeUnitsKernel<<<map.slot_count, kMakeThreads, 0, stream_.get()>>>(map, scene, view());
  DTSDF_CHECK_LAUNCH("makeUnitsKernel");
  return view();
}

size_t UnitMaker::bytes() const {
  return bits_.bytes() + places_.bytes() + units_.bytes() + count_.bytes();
}

std::vector<NamedKernel> viewUnitKernels() {
  return {DTSDF_NAMED_KERNEL(placeUnitsKernel, 0),
          DTSDF_NAMED_KERNEL(makeUnitsKernel, 0, kMakeThreads)};
}

}  // namespace gpu
}  // namespace dtsdf
